"""Trials of the insertion task, one decision at a time, with the actions chosen from outside.

Everything below the choice is the core's, as in any other run: the loop over the ports, perception, motion laws,
supervisor, reinforcement. Nothing here depends on Gymnasium.
"""

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, TypeAlias

import gymnasium.error
import numpy as np
from typing_extensions import override

from palpate.adapters.config import INSERTION, JOB, RigFile, RunConfig, compose, read_job, read_toml, run_facts
from palpate.adapters.experiments import (
    OUTSIDE,
    build_insertion,
    build_reinforcement,
    build_supervisor,
    configured_perception,
    fitted_perception,
    outcome_of,
    ready_pose,
    require_usable,
    score,
    trial_setup,
    trip_of,
)
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.control_loop import next_snapshot, trial_ticks
from palpate.core.errors import CommandError, ConfigurationError, DeviceError, LifecycleError
from palpate.core.perception import Perception
from palpate.core.policy import ActionOutcome, Decision, FixedPolicy, Observation
from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, JointCommand, Rig, Snapshot
from palpate.core.tasks.insertion import InsertionTask
from palpate.core.trial import Outcome, TrialReport


class ActionRefusedError(CommandError, gymnasium.error.InvalidAction):
    """An action that the environment does not have."""

    def __init__(self, text: str, action: object = None) -> None:
        self.value = repr(action)
        Exception.__init__(self, text)


class NotRunningError(LifecycleError, gymnasium.error.ResetNeeded):
    """A step without an episode that runs."""

    def __init__(self, text: str) -> None:
        self.state, self.request = text, "step()"
        Exception.__init__(self, text)


def refuse_unknown(environment: str, unknown: dict[str, object], known: tuple[str, ...]) -> None:
    """Refuse keyword arguments that an environment does not have.

    Raises:
        ConfigurationError: Naming the first of them, and those that there are.
    """
    for name, value in unknown.items():
        raise ConfigurationError(name, value, f"no such argument of {environment}; there are {', '.join(known)}")


SOURCE: Final = OUTSIDE
"""Where decisions come from, in the records of a trial."""


class GivenActions(FixedPolicy):
    """Chooses what it was given; learning happens outside."""

    def __init__(self) -> None:
        super().__init__()
        self._decision: Decision | None = None

    @override
    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        """What was given before is dropped."""
        self._decision = None

    def give(self, decision: Decision) -> None:
        """What :meth:`choose` shall choose next."""
        self._decision = decision

    def choose(self, observation: Observation) -> Decision:
        """What was given; each only once.

        Raises:
            LifecycleError: Nothing was given since the last choice.
        """
        decision, self._decision = self._decision, None
        if decision is None:
            raise LifecycleError("given actions", "none is given", "choose()", "call give() first")
        return decision


MOST_SKIPPED: Final = 20
"""Trials in a row without any decision; a cell in which none ever has one is set up wrongly."""


def without_decision(report: TrialReport) -> DeviceError:
    """Trial after trial was over without a decision, and this is how the last one ended."""
    return DeviceError("work cell", f"{MOST_SKIPPED} trials without any decision: {report.events[-1].detail}")


class Episodes(ABC):
    """Trials of the insertion task, decision by decision.

    Attributes:
        skipped: Trials before it that were over without a decision, since :meth:`begin` was asked for one.
        observe: An agent's observation of the task as it stands.
    """

    rig: Rig
    config: RunConfig
    perception: Perception
    task: InsertionTask
    observe: Callable[[InsertionTask], Any]

    def __init__(self, config: RunConfig) -> None:
        self.config, self.trial, self.skipped = config, 0, 0
        duration_s = config.task.ticks_per_action * PERIOD_S
        self.plain_reinforcement = build_reinforcement(config)(ActionOutcome(duration_s, 0.0))

    @property
    def report(self) -> TrialReport:
        """The core's report of the trial."""
        return self.task.report

    @property
    def outcome(self) -> Outcome | None:
        """How the trial ended; None while it runs."""
        return outcome_of(self.report)

    @property
    def exploration_time_s(self) -> float:
        """Time from contact to now; to the hole (or to the end without it) when the trial is over."""
        if self.report.outcome is not None:
            return self.report.exploration_time_s
        contact_tick = next(event.tick for event in self.report.events if event.name == "contact")
        return (self.report.ticks - 1 - contact_tick) * PERIOD_S

    @property
    @abstractmethod
    def running(self) -> bool:
        """Whether a trial waits for a decision."""

    @abstractmethod
    def begin(self, seed: int, trial: int) -> None:
        """Run a trial to its first decision; one that is over before, straight into the hole, is skipped for the next.

        Raises:
            ConfigurationError: The seed cannot be one.
            DeviceError: A device failed, or trial after trial is over without any decision.
        """

    @abstractmethod
    def decide(self, decision: Decision) -> float:
        """Take an action, and run to the next decision or to the end of the trial.

        Returns:
            The reinforcement that the action earned, as a learner of the core gets it. Where the core gives none,
            because a supervisor or a fault ended the trial, what an action without any excess effort earns.

        Raises:
            NotRunningError: No trial runs.
            DeviceError: A device failed.
        """

    @abstractmethod
    def seen(self) -> tuple[Any, dict[str, Any]]:
        """The observation at the newest decision or end, and what is known of the trial then."""

    @abstractmethod
    def close(self) -> None:
        """Stop the arm and close every device; a second time does nothing."""

    def _known(self, *, success: bool, earned: float) -> dict[str, Any]:
        """For people, for scoring, and for repeating a trial; an agent may not learn from it."""
        report, (symbol, state) = self.report, self.task.percept or (0, 0)
        trip = trip_of(report)
        counted_s = self.config.task.time_limit_s if trip else 0.0
        return {
            "seed": self.config.seed,
            "trial": self.trial,
            "skipped_trials": self.skipped,
            "phase": self.task.phase.value,
            "outcome": "" if self.outcome is None else self.outcome.value,
            "trip": trip,
            "is_success": success,
            "time_s": report.ticks / CONTROL_RATE_HZ,
            "exploration_time_s": max(self.exploration_time_s, counted_s),
            "decisions": len(report.decisions),
            "symbol": self.perception.symbols[symbol],
            "state": self.perception.states[state],
            "reinforcement": earned,
        }


class InsertionEpisodes(Episodes):
    """One simulated work cell, and trials in it; time stands still between the decisions.

    Args:
        config: The run's configuration; its seed only serves a perception that has to be fitted.

    Raises:
        ConfigurationError: A setting is refused.
    """

    def __init__(self, config: RunConfig) -> None:
        ready = ready_pose(config)
        require_usable(config, ready)
        super().__init__(config)
        self._opened = ExitStack()
        self.rig: SimulatedRig = self._opened.enter_context(SimulatedRig(config, ready))
        self.perception = configured_perception(config) or fitted_perception(config, ready, self.rig)
        self._policy = GivenActions()
        self.task = build_insertion(config, ready, self.perception, self._policy)
        self._supervisor = build_supervisor(config, ready, self.rig.sensor_facts)
        self._ticks: Generator[Snapshot, JointCommand, None] | None = None
        self._earned = 0.0

    @override
    def begin(self, seed: int, trial: int) -> None:
        self.config, self._earned = replace(self.config, seed=seed), 0.0
        for skipped in range(MOST_SKIPPED):
            self.trial, self.skipped = trial + skipped, skipped
            self._begin()
            if self._ticks is not None:
                return
        raise without_decision(self.report)

    def _begin(self) -> None:
        self._let_go()
        self._supervisor.latch.release()
        self.rig.seed = self.config.seed
        # The clock too, so that an episode is the same to the last bit whatever was before.
        self.rig.set_clock_ticks(0)
        self.rig.prepare(self.trial)
        self._ticks = trial_ticks(self.task, self.rig.ports, trial_setup(self.config, self.trial), self._supervisor)
        self._advance(self._ticks, first=True)

    @override
    def decide(self, decision: Decision) -> float:
        if self._ticks is None:
            raise NotRunningError("no trial runs; begin one first")
        self._policy.give(decision)
        self._advance(self._ticks)
        earned = self.report.decisions[-1].reinforcement
        self._earned = self.plain_reinforcement if earned is None else earned
        return self._earned

    def _advance(self, ticks: Generator[Snapshot, JointCommand, None], *, first: bool = False) -> None:
        """Tick by tick, from the first or from the middle of one, to the middle of that in which a choice is due."""
        task = self.task
        try:
            snapshot = next(ticks, None) if first else next_snapshot(ticks, task.act())
            while snapshot is not None:
                if task.sense(snapshot) is not None and not task.goes_on:
                    return
                snapshot = next_snapshot(ticks, task.act())
        except BaseException:
            self._let_go()
            raise
        self._ticks = None

    @property
    @override
    def running(self) -> bool:
        return self._ticks is not None

    @override
    def seen(self) -> tuple[Any, dict[str, Any]]:
        truth = self.rig.truth()
        # Adding zero turns a negative zero into zero.
        tip, hole = (np.array(point) + 0.0 for point in (truth.tip_in_task_m, truth.hole_in_task_m))
        known = self._known(success=score(self.config, self.report, truth).success, earned=self._earned)
        true = {"peak_force_N": truth.peak_force_N, "true_depth_m": truth.depth_m}
        return self.observe(self.task), {**known, **true, "true_tip_m": tip, "true_hole_m": hole}

    def _let_go(self) -> None:
        if self._ticks is not None:
            self._ticks.close()
            self._ticks = None

    @override
    def close(self) -> None:
        self._let_go()
        self._opened.close()


Settings: TypeAlias = Mapping[str, Any] | str | os.PathLike[str] | None
"""A nested table of settings, a TOML file with one (a ``run.toml`` too), or nothing."""


def run_config(
    scenario_name: str, arm: str, settings: Settings, task: str = "", job: Settings = None, rig: str = ""
) -> RunConfig:
    """The configuration of the trials.

    Args:
        scenario_name: Preset to start from; empty takes the one of the settings, or ``job`` with a job, or ``paper``.
        arm: Name of the arm; empty takes that of the settings.
        task: Name of the task; empty takes that of the settings.
        job: A job file, or its tables; None for the rig's, or the paper's job.
        rig: A rig file, whose arm, noise and measurements the trials have; empty for the simulator.

    Raises:
        ConfigurationError: A setting is unknown or refused, a file cannot be read, or with a rig no job is stated.
    """
    table = _table(settings)
    # How the run of a run.toml came about is no setting.
    run_facts(table, str(settings))
    file = RigFile.load(Path(rig)) if rig else None
    job = job or (file.job if file is not None and settings is None else None)
    stated = read_job(job) if job else None
    name = scenario_name or table.get("scenario", "paper" if stated is None else JOB)
    told = table.get("task", {})
    named = told.get("name", "") if isinstance(told, Mapping) else ""
    if task and named not in ("", task):
        raise ConfigurationError("task.name", named, f"{task}, which this environment is of")
    learner = table.get("learner", "q-learning")
    own: dict[str, Any] = {"arm": arm} if arm else {}
    noise = None
    if file is not None:
        (table, stated), own, noise = file.laid_over(table, stated, arm), {}, file.facts.noise()
    layers = {**table, "scenario": name}, own
    return compose(name, learner, *layers, task=task or named or INSERTION, job=stated, sensor=noise)


def _table(settings: Settings) -> dict[str, Any]:
    if settings is None:
        return {}
    if isinstance(settings, Mapping):
        return dict(settings)
    if isinstance(settings, (str, os.PathLike)):
        return read_toml(Path(settings))
    raise ConfigurationError("config", settings, "a table of settings, the name of a TOML file, or None")
