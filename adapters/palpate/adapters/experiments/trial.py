"""Run successive trials and score them against the ground truth."""

import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from typing import Any, Final

from typing_extensions import override

from palpate.adapters.config import AcceptanceConfig, RunConfig, folder_kept, task_kind
from palpate.adapters.experiments.build import build_reinforcement
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.adapters.log import TrialRecorder, trial_name, world_of
from palpate.adapters.signals import on_ending_signal
from palpate.core.control_loop import LoopObserver, run_trial
from palpate.core.errors import DeviceError, require_whole
from palpate.core.policy import ActionOutcome
from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, GroundTruth, Rig
from palpate.core.supervision import Supervisor
from palpate.core.trial import Fit, Outcome, Supervised, Task, TrialReport, TrialSetup, Trip, TripReason


@dataclass(frozen=True)
class ScoredTrial:
    """A trial with the core's report and the ground truth.

    Attributes:
        report: The core's report, from port data.
        truth: Ground truth, or None if unknown.
        success: Success as defined by the task, from the report and the ground truth, or from the report alone. False
            for a trial that ended in a trip.
        exploration_time_s: Exploration time in the report; the time limit for a trial that ended in a trip.
        flagged: Reason why the trial's timing was not accepted; empty for an accepted trial.
        stopped_by: Cause of a stop outside the core and the supervisor; otherwise empty.
        trip_source: Device whose samples or delay ended the trial; empty if there is none.
        own: Job values that are specific to this trial, by column of trials.csv.
    """

    report: TrialReport
    truth: GroundTruth | None
    success: bool
    exploration_time_s: float
    flagged: str = ""
    stopped_by: str = ""
    trip_source: str = ""
    own: Mapping[str, float] = field(default_factory=dict)

    @property
    def outcome(self) -> str:
        """Outcome of the trial in words."""
        outcome = outcome_of(self.report)
        return "unknown" if outcome is None else outcome.value

    @property
    def trip(self) -> str:
        """Reason for a trip; see :func:`trip_of`."""
        return trip_of(self.report)

    @property
    def cause(self) -> str:
        """The trip with the device or person that caused it."""
        causes = "; ".join(filter(None, (self.trip_source, self.stopped_by)))
        return f"{self.trip} ({causes})" if causes else self.trip


def outcome_of(report: TrialReport) -> Outcome | None:
    """Return the outcome of a trial; a trip takes precedence over the task's report in the same tick."""
    return report.outcome if report.trip is None else Outcome.TRIPPED


def trip_of(report: TrialReport) -> str:
    """Return the name and text of the reason that the supervisor, sensors or operator ended a trial, or "" if none."""
    if report.trip is not None:
        return str(report.trip)
    return report.events[-1].detail if report.outcome in (Outcome.SENSOR_FAULT, Outcome.STOPPED) else ""


_MOST_TRIALS: Final = 10**9
OVERLOADS: Final = (
    TripReason.FORCE_LIMIT, TripReason.TORQUE_LIMIT, TripReason.FORCE_RATE, TripReason.WORKSPACE,
    TripReason.EXPLORATION_AREA,
)  # fmt: skip
"""Reasons for trips in which valid samples show that the last action exceeded a limit. Other reasons may be faults."""
_OF_THE_ARM: Final = (
    TripReason.JOINT_POSITION, TripReason.JOINT_VELOCITY, TripReason.TRACKING_ERROR, TripReason.WORKSPACE,
    TripReason.EXPLORATION_AREA, TripReason.PLATE_NOT_FOUND,
)  # fmt: skip


def trial_setup(config: RunConfig, trial: int) -> TrialSetup:
    """Return the setup for a trial, which depends only on the run's seed and the trial's index."""
    return task_kind(config.task.name).setup(config.task, config.seed, trial)


def run_scored_trial(
    config: RunConfig,
    rig: Rig,
    task: Task,
    trial: int,
    recorder: TrialRecorder | None = None,
    first: int = 0,
    supervisor: Supervisor | None = None,
    session: RealTimeSession | None = None,
    watching: tuple[LoopObserver, ...] = (),
) -> ScoredTrial:
    """Prepare the world, run one trial on the ports, and score it.

    In the simulator a trip is a result: it is not latched, and the next trial starts.

    Raises:
        ConfigurationError: The trial's number is not between 0 and 10^9.
        FaultLatchedError: A trip or fault on this rig has not been acknowledged.
    """
    require_whole("trial", trial, 0, _MOST_TRIALS)
    # Preparing a trial also moves the arm.
    rig.latch.require_free()
    rig.prepare(trial)
    witness = _Witness(rig)
    setup, observers = trial_setup(config, trial), (*watching, witness)
    if recorder is not None:
        observers = (recorder.begin(setup, world_of(rig), trial_name(trial - first)), *observers)
    if session is not None:
        observers = (session.timer, *observers)
    try:
        with nullcontext() if session is None else session.loop(), folder_kept():
            report = run_trial(task, rig.ports, setup, supervisor, observers)
    except BaseException as error:
        if recorder is not None:
            recorder.fail(task.report, error, _rig_fields(rig, session))
        raise
    scored = score(config, report, rig.truth())
    scored = replace(scored, stopped_by=rig.stopped_by(), trip_source=witness.trip_source)
    if scored.trip and rig.simulated:
        rig.latch.release()
    elif scored.trip and (report.outcome is not Outcome.STOPPED or scored.stopped_by):
        # An agent that leaves an episode early also stops the arm, which is not a fault.
        rig.latch.set(scored.cause)
    if recorder is not None:
        recorder.end(report, truth_fields(scored) | _rig_fields(rig, session))
    return scored


class _Witness(LoopObserver):
    """Observer that records the cause of a trip in the same tick, because a device's data may change later."""

    def __init__(self, rig: Rig) -> None:
        self._rig, self.trip_source = rig, ""
        self._trip: Trip | None = None

    @override
    def supervised(self, supervised: Supervised) -> None:
        change = supervised.command_override
        if change is not None and change.trip is not None and self._trip is None:
            self._trip = change.trip
            self.trip_source = self._source(change.trip)

    def _source(self, trip: Trip) -> str:
        if trip.reason is TripReason.LATE_CYCLE:
            return "the fault of this computer, which was late, or of an adapter that waits"
        if trip.sample:
            return self._rig.device_behind(trip.sample)
        # The cause may be outside the devices, so a device is named only if it reports errors.
        source = self._rig.device_behind("joint" if trip.reason in _OF_THE_ARM else "force")
        return source if ": " in source else ""


def _rig_fields(rig: Rig, session: RealTimeSession | None) -> dict[str, Any]:
    return {"stopped_by": rig.stopped_by(), "timing_json": "" if session is None else session.report_json()}


def score(config: RunConfig, report: TrialReport, truth: GroundTruth | None) -> ScoredTrial:
    """Score the core's report against the ground truth."""
    flagged, time_s = objections(report, config.acceptance), report.exploration_time_s
    if trip_of(report):
        return ScoredTrial(report, truth, False, max(time_s, config.task.time_limit_s), flagged)
    if truth is None:
        return ScoredTrial(report, None, report.outcome in (Outcome.INSERTED, Outcome.DONE), time_s, flagged)
    success = task_kind(config.task.name).achieved(config.task, report, truth, fit_of(config))
    return ScoredTrial(report, truth, success, time_s, flagged)


def fit_of(config: RunConfig) -> Fit:
    """Return the fit between tool and part in the simulated cell."""
    cell = config.cell
    total_tilt_mrad = cell.tilt_mrad + cell.conditions.plate_tilt_mrad
    clearance_mm = max(cell.peg.clearance_mm, cell.worn_clearance_mm)
    return Fit(cell.peg.diameter_mm, clearance_mm, total_tilt_mrad, cell.peg.hole_depth_mm)


def rest_reinforcement(config: RunConfig, exploration_time_s: float) -> float:
    """Return the reinforcement that plain actions would receive in the remaining time of a trial."""
    ticks = config.task.ticks_per_action
    left = int(max(config.task.time_limit_s - exploration_time_s, 0.0) * CONTROL_RATE_HZ / ticks)
    return left * build_reinforcement(config)(ActionOutcome(ticks * PERIOD_S, 0.0))


def truth_fields(scored: ScoredTrial) -> dict[str, Any]:
    """Return the fields in a log's end record that depend on the ground truth; they are empty if it is unknown."""
    if scored.truth is None:
        return {}
    return {
        "success": scored.success,
        "true_peak_force_N": scored.truth.peak_force_N,
        "true_depth_m": scored.truth.depth_m,
        "true_tip_in_task_m": scored.truth.tip_in_task_m,
        "true_hole_in_task_m": scored.truth.hole_in_task_m,
    }


def objections(report: TrialReport, config: AcceptanceConfig) -> str:
    """Return the reasons for flagging a trial's timing, separated by semicolons, or "" if there are none."""
    timing, ticks = report.timing, max(report.ticks, 1)
    found = []
    if timing.worst_late_ns > config.max_late_ms * 1e6:
        found.append(f"a tick too late ({timing.worst_late_ns * 1e-6:.1f} ms)")
    if timing.late_ticks > config.max_late_share * ticks:
        found.append(f"too many late ticks ({timing.late_ticks / ticks:.0%})")
    if timing.skipped_slots > config.max_skipped_share * (ticks + timing.skipped_slots):
        found.append(f"slots skipped ({timing.skipped_slots})")
    if timing.repeated_samples > config.max_repeated_share * ticks:
        found.append(f"too few new samples ({timing.repeated_samples / ticks:.0%} of the ticks had none)")
    return "; ".join(found)


def require_sound(rig: Rig, scored: ScoredTrial, first: int = 0) -> None:
    """Raise an error after a trip on a rig with devices; ``first`` is the index of the trial that is numbered 0.

    Raises:
        DeviceError: A trip ended the trial; the error gives the trial's number as in the tables.
    """
    if scored.trip and not rig.simulated:
        raise DeviceError("rig", f"trial {scored.report.setup.index - first}: {scored.cause}")


@contextmanager
def interrupting(request_end: Callable[[], None]) -> Iterator[None]:
    """Within the context, treat a termination signal as a shutdown request; a second SIGINT has its usual effect.

    Signals are delivered only to a program's main thread; in any other thread, the context does nothing.
    """

    def act(number: int) -> None:
        signal.signal(signal.SIGINT, before)
        request_end()

    before = signal.getsignal(signal.SIGINT)
    with on_ending_signal(act):
        yield
