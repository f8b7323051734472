"""One run of the campaign: a trial, a fault in it, and what came of both."""

import enum
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from math import dist
from pathlib import Path
from typing import Final

from palpate.adapters.config import RunConfig, folder_kept, task_kind
from palpate.adapters.experiments import (
    ChosenPolicy,
    build_supervisor,
    build_task,
    fit_of,
    score,
    trial_setup,
    truth_fields,
)
from palpate.adapters.fault_injection.campaign.variants import Variant
from palpate.adapters.fault_injection.ports import faulty
from palpate.adapters.fault_injection.schedule import FaultDelivery
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.adapters.log import CallEntry, MemorySink, TrialLog, TrialRecorder, assemble, sound_messages, world_of
from palpate.core.control_loop import run_trial
from palpate.core.errors import LogError, PalpateError, PolicyError
from palpate.core.motion import Kinematics, ToolGeometry, arm_named
from palpate.core.ports import ForceSensor, Rig, SensorDecorator, Validity, Vector3, WrenchSample
from palpate.core.supervision import Supervisor
from palpate.core.trial import Outcome, ReadyPose, Task, TrialReport

HARDWARE_LIMIT_N: Final = 60.0
"""A true force above this counts as damage: the paper's sensor saturates there, and so may a real one."""
_FAULT_CALL: Final = "fault"


class Class(enum.Enum):
    """What a run shows about its fault."""

    TOLERABLE = "tolerable"
    DETECTED = "detected"
    UNOBSERVABLE = "unobservable"
    FAILED = "FAILED"
    FALSE_SUCCESS = "FALSE SUCCESS"
    NOT_STRUCK = "not struck"


@dataclass(frozen=True)
class FaultRun:
    """What came of one run.

    Attributes:
        delivered: Whether it struck at all; a trial may end before.
        ticks_to_stop: From the delivery to the last tick; None when the trial ended in the ordinary way.
        cause: What stopped it, in words; empty when nothing did.
        latched: Its latch lets no further trial begin until that is acknowledged.
        peak_force_N: Largest true force; where that is not known, the largest change that the sensor measured before
            any fault of its own.
        damage: A true force above ``HARDWARE_LIMIT_N``, or a joint outside its limits.
    """

    variant: str
    phase: str
    seed: int
    delivered: bool
    outcome: str
    ticks_to_stop: int | None
    cause: str
    latched: bool
    safe_stop: bool
    peak_force_N: float
    damage: bool
    log_intact: bool
    verdict: Class


class ForceProbe(SensorDecorator[WrenchSample], ForceSensor):
    """Passes samples on and keeps the largest change of the force since the first one."""

    def __init__(self, sensor: ForceSensor) -> None:
        super().__init__(sensor, self._noted)
        self.peak_N = 0.0
        self._first_N: Vector3 | None = None

    def _noted(self, sample: WrenchSample) -> WrenchSample:
        if sample.validity is not Validity.INVALID:
            if self._first_N is None:
                self._first_N = sample.force_N
            self.peak_N = max(self.peak_N, dist(sample.force_N, self._first_N))
        return sample


class Bench:
    """A rig on which the campaign runs trial after trial.

    Args:
        supervised: False lets every command through: to show what the supervisor is good for.
    """

    def __init__(
        self,
        config: RunConfig,
        ready: ReadyPose,
        rig: Rig,
        *,
        supervised: bool,
        session: RealTimeSession | None = None,
        policy: str,
    ) -> None:
        self._chosen = ChosenPolicy(policy, config)
        self.config, self._ready, self._rig, self._supervised = config, ready, rig, supervised
        self._loop: Callable[[], AbstractContextManager[object]] = nullcontext if session is None else session.loop
        kinematics = Kinematics(arm_named(config.arm), ToolGeometry())
        self._lower, self._upper = kinematics.lower_rad.tolist(), kinematics.upper_rad.tolist()

    def ticks(self, seed: int) -> dict[str, list[int]]:
        """The ticks of each phase of the trial of this seed, without any fault; a phase may come again."""
        task, _ = self._parts()
        self._rig.prepare(seed)
        with self._loop(), folder_kept():
            report = run_trial(task, self._rig.ports, trial_setup(self.config, seed))
        begins = [(event.detail, event.tick) for event in report.events if event.name == "phase"]
        ends = [tick for _, tick in begins[1:]] + [report.ticks]
        phases = dict[str, list[int]]()
        for (phase, tick), end in zip(begins, ends, strict=True):
            phases.setdefault(phase, []).extend(range(tick, end))
        return phases

    def run(self, variant: Variant, phase: str, tick: int, seed: int) -> FaultRun:
        """One trial with a fault from this tick on."""
        task, supervisor = self._parts()
        sink, deliveries = MemorySink(), list[FaultDelivery]()
        error: PalpateError | None = None
        with TrialRecorder(lambda: sink, Path("."), self.config.recording) as recorder:
            policy, perception = self._chosen.on(self._rig), self._chosen.perception
            name = self._chosen.name if self._chosen.document is None else ""
            recorder.of("faults", self.config, self._ready, task, perception, policy, name=name)

            def record(delivery: FaultDelivery) -> None:
                deliveries.append(delivery)
                entry = CallEntry(
                    tick=recorder.flight.tick,
                    port=delivery.port,
                    call=_FAULT_CALL,
                    text=f"{delivery.kind}: {delivery.text}",
                )
                recorder.flight.call(entry)

            self._rig.prepare(seed)
            setup = trial_setup(self.config, seed)
            probe = ForceProbe(self._rig.ports.force_sensor)
            bad = faulty(
                replace(self._rig.ports, force_sensor=probe), variant.at(tick, seed, self._rig.sensor_facts), record
            )
            observer = recorder.begin(setup, world_of(self._rig), "run")
            try:
                with self._loop(), folder_kept():
                    report = run_trial(task, bad, setup, supervisor, (observer,))
                scored = score(self.config, report, self._rig.truth())
                recorder.end(report, truth_fields(scored))
            except PolicyError:
                # None of the faults that were injected.
                raise
            except PalpateError as caught:
                error = caught
                recorder.fail(task.report, caught)
        if task.report.outcome not in (Outcome.INSERTED, Outcome.DONE):
            # Wherever it was stopped: the next run begins as the first one did.
            self._rig.return_to_ready()
        truth = self._rig.truth()
        peak_N = probe.peak_N if truth is None else truth.peak_force_N
        run = self._judged(variant, phase, seed, deliveries, task, supervisor, error, sink.logs, peak_N)
        kind, fit = task_kind(self.config.task.name), fit_of(self.config)
        false = truth is not None and kind.untrue(self.config.task, task.report, truth, fit)
        return replace(run, verdict=Class.FALSE_SUCCESS) if false else run

    def _parts(self) -> tuple[Task, Supervisor | None]:
        config = self.config
        task = build_task(config, self._ready, self._chosen.perception, self._chosen.on(self._rig))
        # The next run begins anew after a trip: that is what a campaign is for.
        supervisor = build_supervisor(config, self._ready, self._rig.sensor_facts) if self._supervised else None
        return task, supervisor

    def _judged(
        self,
        variant: Variant,
        phase: str,
        seed: int,
        deliveries: Sequence[FaultDelivery],
        task: Task,
        supervisor: Supervisor | None,
        error: PalpateError | None,
        logs: Sequence[bytes],
        peak_N: float,
    ) -> FaultRun:
        log, report = read_back(logs), task.report
        damage = peak_N > HARDWARE_LIMIT_N or (log is not None and self._left_limits(log))
        struck = [] if log is None else [call.tick for call in log.calls if call.call == _FAULT_CALL]
        intact = log is not None and log.end is not None and len(struck) == len(deliveries)
        stop = _stop_tick(log, supervisor, report.outcome, error, report.ticks - 1)
        outcome = type(error).__name__ if error is not None else report.outcome.value if report.outcome else ""
        ticks = None if stop is None or not struck else max(stop - struck[0], 0)
        lived = report.ticks - 1 - struck[0] if struck else 0
        stopped = log is not None and any((call.port, call.call) == ("arm", "stop") for call in log.calls)
        verdict = Class.NOT_STRUCK
        if deliveries:
            harmless = peak_N <= self.config.task.max_force_N
            verdict = _verdict(variant, ticks, lived, damage=damage, intact=intact and stopped, harmless=harmless)
        return FaultRun(
            variant=variant.name,
            phase=phase,
            seed=seed,
            delivered=bool(deliveries),
            outcome=outcome,
            ticks_to_stop=ticks,
            cause="" if stop is None else _cause(supervisor, error, report),
            latched=supervisor is not None and bool(supervisor.latch.cause),
            safe_stop=stopped,
            peak_force_N=peak_N,
            damage=damage,
            log_intact=intact,
            verdict=verdict,
        )

    def _left_limits(self, log: TrialLog) -> bool:
        return any(
            not low <= q <= high
            for record in log.records()
            if record.applied is not None
            for q, low, high in zip(record.applied.position_rad, self._lower, self._upper, strict=True)
        )


def read_back(logs: Sequence[bytes]) -> TrialLog | None:
    """The log of the run; None when it cannot be read."""
    try:
        return assemble("run", logs[0], list(sound_messages("run", logs[0])))
    except (LogError, IndexError):
        return None


def _stop_tick(
    log: TrialLog | None, supervisor: Supervisor | None, outcome: Outcome | None, error: PalpateError | None, last: int
) -> int | None:
    """The tick in which the trial was stopped for a fault; None when it ended in the ordinary way."""
    if supervisor is not None and supervisor.trip is not None:
        return supervisor.trip.tick
    if error is not None:
        return last if log is None else max(len(log.ticks) - 1, 0)
    if outcome in (Outcome.SENSOR_FAULT, Outcome.STOPPED, Outcome.FORCE_LIMIT):
        return last
    return None


def _cause(supervisor: Supervisor | None, error: PalpateError | None, report: TrialReport) -> str:
    if supervisor is not None and supervisor.trip is not None:
        return supervisor.trip.text
    return str(error) if error is not None else report.events[-1].detail


def _verdict(variant: Variant, ticks: int | None, lived: int, *, damage: bool, intact: bool, harmless: bool) -> Class:
    """What a run shows.

    Args:
        ticks: From its delivery to the stop; None if there was none.
        lived: Ticks from its delivery to the trial's end.
        damage: Whether a limit of the hardware was exceeded. A stop in time counts as detected even when it could not
            prevent that; it is reported beside.
        intact: Whether the log holds it, and the arm's stop.
        harmless: Whether the true force stayed below the task's limit, so that a lie that went unnoticed did nothing.
    """
    patience = variant.patience_ticks
    if not intact:
        return Class.FAILED
    if ticks is not None:
        return Class.FAILED if patience is not None and ticks > patience else Class.DETECTED
    if variant.hidden:
        return Class.TOLERABLE if harmless else Class.UNOBSERVABLE
    # Plain to see, and yet the trial went on to its end; unless that came first.
    overlooked = patience is not None and lived > patience
    return Class.FAILED if damage or overlooked else Class.TOLERABLE
