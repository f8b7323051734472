"""Trials with a policy on an open rig's ports."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Final

from palpate.adapters.config import RunConfig, of_trial
from palpate.adapters.experiments.build import (
    build_perception,
    build_task,
    needs_fitting,
    ready_pose,
    supervisor_of,
    task_bounds,
)
from palpate.adapters.experiments.trial import ScoredTrial, interrupting, require_sound, run_scored_trial
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.adapters.log import TrialRecorder
from palpate.core.control_loop import LoopObserver
from palpate.core.perception import Perception
from palpate.core.policy import BeliefLearner, Policy, ThirdPartyPolicy, learner_of
from palpate.core.ports import Rig
from palpate.core.trial import Outcome, ReadyPose


class TrialsObserver(LoopObserver):
    """An observer of successive trials, such as a live view."""

    def of(self, trials: Trials) -> None:
        """Receive the trials that will run next."""


@dataclass(frozen=True)
class Recording:
    """Recorder, loop timing (on a rig) and live view for a run; each is None if absent."""

    recorder: TrialRecorder | None = None
    session: RealTimeSession | None = None
    live: TrialsObserver | None = None

    @property
    def losses(self) -> list[str]:
        """Recording failures."""
        return [] if self.recorder is None else self.recorder.losses

    @property
    def timing(self) -> str:
        """Loop timing, or an empty string in the simulator."""
        return "" if self.session is None else self.session.report()


NOT_RECORDED: Final = Recording()


class Trials:
    """The task, supervisor and recorder for a policy, ready for its trials.

    Args:
        name: Name of a policy without a policy file; otherwise empty.
        subfolder: Folder for the logs within the recorder's folder.
        first: Index of the trial that is numbered 0 in logs and tables.

    Raises:
        FaultLatchedError: A trip or fault on this rig has not been acknowledged (``rig.latch.acknowledge``).
        ConfigurationError: A limit does not suit the rig.
    """

    def __init__(
        self,
        config: RunConfig,
        ready: ReadyPose,
        rig: Rig,
        perception: Perception,
        policy: Policy,
        recording: Recording = NOT_RECORDED,
        *,
        command: str = "run",
        name: str = "",
        subfolder: str = "",
        first: int = 0,
    ) -> None:
        if isinstance(policy, ThirdPartyPolicy):
            policy.now_ns = rig.ports.clock.now_ns
        self.run_config, self.rig, self._command, self._subfolder = config, rig, command, subfolder
        self.perception, self.policy, self.name = perception, policy, name
        self.recording, self.first, self.interrupted = recording, first, False
        self._begin(config, ready)

    def _begin(self, config: RunConfig, ready: ReadyPose) -> None:
        """Build the task and the supervisor for a trial's configuration."""
        self.config, self.ready, recording = config, ready, self.recording
        self.task = build_task(config, ready, self.perception, self.policy)
        self.supervisor = supervisor_of(self.rig, config, ready)
        if recording.live is not None:
            recording.live.of(self)
        if recording.recorder is not None:
            learner = learner_of(self.policy)
            recording.recorder.of(
                self._command, config, ready, self.task, self.perception, self.policy,
                name=self.name, frozen=learner is None or learner.frozen, subfolder=self._subfolder,
            )  # fmt: skip

    def _turn_to(self, number: int) -> dict[str, float]:
        """Prepare the place and the force limit of a trial; return the values that are specific to it."""
        whole, trial = self.run_config, number - self.first
        drawn = self._command == "train" and self.rig.simulated
        config = of_trial(whole, trial, drawn=drawn)
        if config != self.config:
            ready = ready_pose(config)
            self.rig.move(config, ready)
            if drawn and not needs_fitting(config):
                # Thresholds depend on the pressing force.
                self.perception = build_perception(config)
            learner = learner_of(self.policy)
            if isinstance(learner, BeliefLearner):
                learner.step_within(task_bounds(config))
            self._begin(config, ready)
        own = {"place": 1 + trial % len(whole.place.centres_mm)} if whole.place.further_mm else {}
        return own | ({"limit_N": config.limits.force_N} if drawn and whole.limits.drawn_from_N else {})

    def run(self, number: int, watching: tuple[LoopObserver, ...] = ()) -> ScoredTrial:
        """Run one trial and score it.

        Raises:
            DeviceError: A device failed.
        """
        own = self._turn_to(number)
        recorder, session, live = self.recording.recorder, self.recording.session, self.recording.live
        watching = watching if live is None else (*watching, live)
        scored = run_scored_trial(
            self.config, self.rig, self.task, number, recorder, self.first, self.supervisor, session, watching
        )
        return replace(scored, own=own) if own else scored

    def run_all(self, numbers: Iterable[int], done: Callable[[ScoredTrial], object]) -> None:
        """Run trials until all are finished or a signal ends them; an interrupted trial does not count as finished.

        Raises:
            DeviceError: A sensor failed, the arm was stopped, or the supervisor tripped on a rig with devices.
        """
        with interrupting(self._end):
            for number in numbers:
                scored = self.run(number)
                self.interrupted = self.interrupted or scored.report.outcome is Outcome.INTERRUPTED
                if scored.report.outcome is Outcome.INTERRUPTED:
                    return
                done(scored)
                require_sound(self.rig, scored, self.first)
                if self.interrupted:
                    return

    def _end(self) -> None:
        self.interrupted = True
        self.task.interrupt()
