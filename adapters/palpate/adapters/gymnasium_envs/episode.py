"""Insertion trials, decision by decision, with externally chosen actions.

The core does everything except choose the actions, as in any other run: control loop, perception, controllers,
supervisor and reinforcement. Each trial has its own thread; the agent's thread waits for the loop's views. Only the
error classes depend on Gymnasium.
"""

import sys
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from threading import Thread
from typing import Any, Final

import gymnasium.error
import numpy as np

from palpate.adapters import experiments
from palpate.adapters.gymnasium_envs.agent import GRACE_S, Agent
from palpate.adapters.mujoco import SimulatedRig
from palpate.adapters.signals import on_ending_signal
from palpate.core.errors import CommandError, ConfigurationError, DeviceError, LifecycleError, require_in
from palpate.core.policy import ActionOutcome, Decision
from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, Rig
from palpate.core.tasks.insertion import InsertionTask
from palpate.core.trial import Outcome, TrialReport


class ActionRefusedError(CommandError, gymnasium.error.InvalidAction):
    """The environment does not have this action."""

    def __init__(self, text: str, action: object = None) -> None:
        self.value = repr(action)
        Exception.__init__(self, text)


class NotRunningError(LifecycleError, gymnasium.error.ResetNeeded):
    """A step was requested while no episode was running."""

    def __init__(self, text: str) -> None:
        self.state, self.request = text, "step()"
        Exception.__init__(self, text)


MOST_SKIPPED: Final = 20
"""Maximum number of consecutive trials without a decision. A larger number indicates an incorrect set-up."""
_TIMEOUT_S: Final = 5.0


class Episodes:
    """Insertion trials, decision by decision, in the simulator or on a rig.

    In the simulator, time stops between decisions. On a rig it continues, and trials are recorded in a folder like
    that of ``palpate run``.

    Args:
        out: On a rig, the folder for the recording; if empty, the next free folder below ``runs``.
        limit_s: On a rig, time limit for a decision, after which the arm is stopped and the rig latched.

    Attributes:
        running: True if a trial is waiting for a decision.
        skipped: Number of trials since :meth:`begin` that ended without a decision.

    Raises:
        ConfigurationError: A setting is rejected, or the task is not an insertion.
        DeviceError: A device failed.
        LifecycleError: A rig was opened outside the main thread.
    """

    def __init__(self, run: experiments.Run, out: str = "", limit_s: float = 0.3) -> None:
        require_in("decision_limit_s", limit_s, 0.01, 60.0)
        self.on_rig = bool(run.rig_file)
        if self.on_rig and threading.current_thread() is not threading.main_thread():
            # Signals, including the operator's, reach only the main thread.
            raise LifecycleError("rig", "in another thread", "open()", "make the environment in the main thread")
        self.config, self.trial, self.skipped, self.running = run.config, 0, 0, False
        experiments.require_usable(run.config, run.ready, run.rig_file)
        duration_s = run.config.task.ticks_per_action * PERIOD_S
        self.plain_reinforcement = experiments.build_reinforcement(run.config)(ActionOutcome(duration_s, 0.0))
        self.observe: Callable[[InsertionTask], Any] = lambda task: None
        self.folder: experiments.RunFolder | None = None
        if self.on_rig:
            self.folder = experiments.folder_named(out, f"{run.config.scenario}-{experiments.OUTSIDE}")
            self.folder.require_free()
        self._agent = Agent(limit_s, GRACE_S) if self.on_rig else Agent()
        self._agent.look = self._look
        self._rows: list[experiments.TrialRow] = []
        self._settled, self._begun = 0, 0
        self._moment: tuple[Any, dict[str, Any]] = (None, {})
        self._thread = Thread()
        # The same perception as for an agent trained in the simulator.
        self.perception = experiments.simulated_perception(run.config, run.ready)
        with ExitStack() as kept, ExitStack() as opened:
            self.rig: Rig = opened.enter_context(run.opened())
            if self.folder is not None:
                run.begin(kept, self.folder, "run", policy=experiments.OUTSIDE, rig=run.rig_file)
                kept.callback(self._write)
            recording = run.record(kept, opened, self.folder)
            self._trials = experiments.Trials(
                run.config, run.ready, self.rig, self.perception, self._agent, recording, name=experiments.OUTSIDE
            )
            _insertion(self._trials)
            if self.on_rig:
                # By default the process would end at once and leave the arm at its last set-point.
                opened.enter_context(on_ending_signal(lambda number: sys.exit(128 + number), always=False))
            kept.enter_context(opened.pop_all())
            self._kept = kept.pop_all()

    # The agent's side.

    @property
    def task(self) -> InsertionTask:
        """Return the trial's task; each place in the job has its own task."""
        return _insertion(self._trials)

    @property
    def report(self) -> TrialReport:
        """Return the core's report on the trial."""
        return self.task.report

    @property
    def outcome(self) -> Outcome | None:
        """Return the outcome of the trial, or None while it is running."""
        return experiments.outcome_of(self.report)

    @property
    def exploration_time_s(self) -> float:
        """Return the time since contact or, for a finished trial, from contact to the hole or the end of the trial."""
        if self.report.outcome is not None:
            return self.report.exploration_time_s
        contact_tick = next(event.tick for event in self.report.events if event.name == "contact")
        return (self.report.ticks - 1 - contact_tick) * PERIOD_S

    def begin(self, seed: int, trial: int) -> None:
        """Run a trial to its first decision; skip trials that end before a decision.

        Raises:
            ConfigurationError: The seed is invalid.
            DeviceError: A device failed, or too many trials ended without a decision.
        """
        self._leave()
        self.config = self._trials.run_config = self._trials.config = replace(self.config, seed=seed)
        for skipped in range(MOST_SKIPPED):
            self.trial, self.skipped = trial + skipped, skipped
            if not self.on_rig and isinstance(self.rig, SimulatedRig):
                # Reset the clock too, so that an episode is bit-for-bit independent of earlier ones.
                self.rig.latch.release()
                self.rig.seed = seed
                self.rig.set_clock_ticks(0)
            self._agent.new_trial()
            self._settled = 0
            self._thread = Thread(target=self._run, args=(self.trial,), name="control loop", daemon=True)
            self._thread.start()
            self._await()
            if self.running:
                return
        problem = f"{MOST_SKIPPED} trials without any decision: {self.report.events[-1].detail}"
        raise DeviceError("work cell", problem)

    def decide(self, decision: Decision) -> float:
        """Execute an action, run to the next decision or the end of the trial, and return the action's reinforcement.

        A learner of the core receives the same reinforcement. If the core gives none, because the supervisor or a fault
        ended the trial, the reinforcement is that of an action without excess effort.

        Raises:
            NotRunningError: No trial is running.
            DeviceError: A device failed.
        """
        if not self.running:
            raise NotRunningError("no trial runs; begin one first")
        self._agent.give(decision)
        self._await()
        earned: float = self._moment[1]["reinforcement"]
        return earned

    def seen(self) -> tuple[Any, dict[str, Any]]:
        """Return the observation and the information about the trial at the latest decision or at the trial's end."""
        return self._moment

    def close(self) -> None:
        """Stop the arm and close every device; a second call does nothing."""
        self._leave()
        self._kept.close()

    def _await(self) -> None:
        self.running = False
        try:
            shown = self._agent.shown.get()
        except BaseException:
            # This includes Ctrl-C: no further decision will be requested.
            self._leave()
            raise
        if isinstance(shown, BaseException):
            self._thread.join()
            raise shown
        self._moment = shown
        self.running = not shown[1]["outcome"]
        if not self.running:
            self._thread.join()

    def _leave(self) -> None:
        """End the running trial, in any loop state; preparing the next trial releases the stopped arm."""
        self.running = False
        self._agent.leave()
        deadline_s = time.monotonic() + _TIMEOUT_S
        while self._thread.is_alive() and time.monotonic() < deadline_s:
            if self.on_rig:
                self.rig.ports.arm.stop()
            if self._thread is threading.current_thread():
                # The garbage collector may run in any thread.
                return
            self._thread.join(GRACE_S)

    def _write(self) -> None:
        """Write the trial results after everything is closed."""
        if self._rows and self.folder is not None:
            experiments.write_evaluation(
                self.config, self.folder, experiments.OUTSIDE, None, self._rows, len(self._rows)
            )

    # The loop's side.

    def _run(self, trial: int) -> None:
        shown: Any
        try:
            # Logs and tables are numbered in trial order.
            self._trials.first = trial - self._begun
            self._begun += 1
            scored = self._trials.run(trial, (self._agent,))
            if self.folder is not None:
                self._rows.append(self.folder.append_trial(scored, self._trials.first))
            experiments.require_sound(self.rig, scored, self._trials.first)
            shown = self._look(success=scored.success)
        except BaseException as error:
            # Every error must be raised on the agent's side.
            shown = error
        self._agent.shown.put(shown)

    def _look(self, *, success: bool = False) -> tuple[Any, dict[str, Any]]:
        """Return the observation, and information for users and scoring, which an agent must not learn from."""
        report, (symbol, state) = self.report, self.task.percept or (0, 0)
        # The cost of earlier pauses is charged to the agent.
        new, self._settled = report.decisions[self._settled :], len(report.decisions)
        # Within an option there is no reinforcement; if a trial ended within an action, none was determined.
        earned = sum(one.reinforcement for one in new if one.reinforcement is not None)
        earned += self.plain_reinforcement if new and new[-1].reinforcement is None else 0.0
        trip = experiments.trip_of(report)
        counted_s = self.config.task.time_limit_s if trip else 0.0
        known = {
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
            "reinforcement": float(earned),
        }
        truth = None if self.on_rig else self.rig.truth()
        if truth is None:
            known |= {"peak_force_N": report.peak_force_N, "late_decisions": self._agent.late_decisions}
        else:
            # Adding zero turns a negative zero into zero.
            tip, hole = (np.array(point) + 0.0 for point in (truth.tip_in_task_m, truth.hole_in_task_m))
            known |= {"peak_force_N": truth.peak_force_N, "true_depth_m": truth.depth_m}
            known |= {"true_tip_m": tip, "true_hole_m": hole}
        return self.observe(self.task), known


def _insertion(trials: experiments.Trials) -> InsertionTask:
    if not isinstance(trials.task, InsertionTask):
        name = trials.config.task.name
        raise ConfigurationError("task.name", name, "insertion")
    return trials.task
