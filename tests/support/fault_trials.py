"""Simulated trials with an injected fault, and their verdicts."""

import enum
from dataclasses import dataclass

import numpy as np

from palpate.adapters.config import task_kind
from palpate.adapters.experiments import (
    ChosenPolicy,
    build_supervisor,
    build_task,
    fit_of,
    in_processes,
    ready_pose,
    trial_setup,
)
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.control_loop import LoopObserver, run_trial
from palpate.core.errors import PalpateError, PolicyError
from palpate.core.motion import Kinematics, arm_named
from palpate.core.trial import Outcome, Phase
from tests.support.fault_list import Fault, device_faults, sensor_faults
from tests.support.faults import FaultyArm, faulty
from tests.support.tool import TOOL

DAMAGE = 2.0
"""A true force above this multiple of the job's limit counts as damage; the paper's sensor saturates there."""
PHASES = tuple(phase.value for phase in (Phase.TRANSFER, Phase.SETTLE, Phase.APPROACH, Phase.EXPLORE, Phase.INSERT))
"""Phases in which a fault can strike in every trial of an insertion."""
_LATE_TICKS = 3
"""Ticks that a stop may take after the first sign of a fault."""


def all_faults(config):
    """List device faults, then sensor faults. A fault's place is part of the seed of its ticks."""
    return device_faults(config) + sensor_faults()


# A trial.


class Verdict(enum.Enum):
    """Verdict on a trial with a fault."""

    TOLERABLE = "tolerable"
    DETECTED = "detected"
    UNOBSERVABLE = "unobservable"
    FAILED = "FAILED"
    FALSE_SUCCESS = "FALSE SUCCESS"
    NOT_STRUCK = "not struck"


@dataclass(frozen=True)
class FaultRun:
    """The result of a trial with a fault."""

    fault: Fault
    phase: str
    seed: int
    delivered: bool
    outcome: str
    ticks_to_stop: int | None
    cause: str
    latched: bool
    safe_stop: bool
    peak_force_N: float
    damage_N: float
    verdict: Verdict


class _Course(LoopObserver):
    """Keeps the newest tick, and whether a joint was outside its limits."""

    def __init__(self, kinematics):
        self.tick, self.left_limits = 0, False
        self._lower_rad, self._upper_rad = kinematics.lower_rad.tolist(), kinematics.upper_rad.tolist()

    def waited(self, tick, deadline_ns):
        self.tick = tick

    def sent(self, snapshot, command, applied):
        inside = map(lambda low, q, high: low <= q <= high, self._lower_rad, applied.position_rad, self._upper_rad)
        self.left_limits = self.left_limits or not all(inside)


class Bench:
    """A simulated rig for trial after trial with faults."""

    def __init__(self, config, rig, policy, *, supervised=True):
        self.config, self._rig, self._supervised = config, rig, supervised
        self._chosen, self._ready = ChosenPolicy(policy, config), ready_pose(config)

    def ticks(self, seed):
        """Return the ticks of each phase of the trial of a seed without faults; a phase may come again."""
        task, _ = self._parts()
        self._rig.prepare(seed)
        report = run_trial(task, self._rig.ports, trial_setup(self.config, seed))
        begins = [(event.detail, event.tick) for event in report.events if event.name == "phase"]
        ends = [tick for _, tick in begins[1:]] + [report.ticks]
        phases = dict[str, list[int]]()
        for (phase, tick), end in zip(begins, ends, strict=True):
            phases.setdefault(phase, []).extend(range(tick, end))
        return phases

    def run(self, fault, phase, tick, seed):
        """Run a trial with a fault from a tick on."""
        task, supervisor = self._parts()
        struck, error = list[int](), None
        self._rig.prepare(seed)
        trajectory = _Course(Kinematics(arm_named(self.config.arm), TOOL))
        plans = fault.at(tick, seed, self._rig.sensor_facts)
        ports = faulty(self._rig.ports, plans, lambda moment: struck.append(trajectory.tick))
        try:
            run_trial(task, ports, trial_setup(self.config, seed), supervisor, (trajectory,))
        except PolicyError:
            raise
        except PalpateError as caught:
            error = caught
        report, truth = task.report, self._rig.truth()
        damage_N = DAMAGE * self.config.task.max_force_N
        damage = truth.peak_force_N > damage_N or trajectory.left_limits
        stop = _stop_tick(trajectory.tick, supervisor, report.outcome, error)
        ticks = None if stop is None or not struck else max(stop - struck[0], 0)
        safe_stop = isinstance(ports.arm, FaultyArm) and ports.arm.stopped
        kind = task_kind(self.config.task.name)
        if kind.untrue(self.config.task, report, truth, fit_of(self.config)):
            verdict = Verdict.FALSE_SUCCESS
        elif not struck:
            verdict = Verdict.NOT_STRUCK
        elif not safe_stop:
            verdict = Verdict.FAILED
        else:
            harmless = truth.peak_force_N <= self.config.task.max_force_N
            verdict = _verdict(fault, ticks, trajectory.tick - struck[0], damage=damage, harmless=harmless)
        return FaultRun(
            fault=fault,
            phase=phase,
            seed=seed,
            delivered=bool(struck),
            outcome=type(error).__name__ if error is not None else report.outcome.value if report.outcome else "",
            ticks_to_stop=ticks,
            cause="" if stop is None else _cause(supervisor, error, task),
            latched=supervisor is not None and bool(supervisor.latch.cause),
            safe_stop=safe_stop,
            peak_force_N=truth.peak_force_N,
            damage_N=damage_N,
            verdict=verdict,
        )

    def _parts(self):
        config = self.config
        task = build_task(config, self._ready, self._chosen.perception, self._chosen.on(self._rig))
        # A supervisor of its own for each trial, so that a latched trip does not hold up the next one.
        supervisor = build_supervisor(config, self._ready, self._rig.sensor_facts) if self._supervised else None
        return task, supervisor


def _stop_tick(newest, supervisor, outcome, error):
    """Return the tick in which the trial was stopped for a fault; None when it ended in the ordinary way."""
    if supervisor is not None and supervisor.trip is not None:
        return supervisor.trip.tick
    stopped = outcome in (Outcome.SENSOR_FAULT, Outcome.STOPPED, Outcome.FORCE_LIMIT)
    return newest if error is not None or stopped else None


def _cause(supervisor, error, task):
    if supervisor is not None and supervisor.trip is not None:
        return supervisor.trip.text
    return str(error) if error is not None else task.report.events[-1].detail


def _verdict(fault, ticks, lived, *, damage, harmless):
    """Judge a trial in which the fault struck."""
    in_time = None if fault.silent_ticks is None else fault.silent_ticks + _LATE_TICKS
    if ticks is not None:
        return Verdict.FAILED if in_time is not None and ticks > in_time else Verdict.DETECTED
    if fault.plausible:
        return Verdict.TOLERABLE if harmless else Verdict.UNOBSERVABLE
    overlooked = in_time is not None and lived > in_time
    return Verdict.FAILED if damage or overlooked else Verdict.TOLERABLE


# Many trials.


@dataclass(frozen=True)
class Case:
    """A trial to run."""

    fault: Fault
    phase: str
    seed: int


def cases(config, seeds, keep):
    """List every fault in every phase for every seed; sensor faults also from the first tick on."""
    every = (
        Case(fault, phase, seed)
        for seed in seeds
        for faults, first in ((device_faults(config.supervision), ()), (sensor_faults(), (Phase.LIFT.value,)))
        for fault in faults
        for phase in (*PHASES, *first)
    )
    return [case for case in every if keep(case)]


def run_cases(config, chosen, policy, *, jobs=1, supervised=True):
    """Run trials, seed by seed; results do not depend on the number of processes."""
    by_seed = {}
    for case in chosen:
        by_seed.setdefault(case.seed, []).append(case)
    work = [(config, own, policy, supervised) for own in by_seed.values()]
    if jobs == 1:
        for one in work:
            yield _one_seed(*one)
        return
    yield from in_processes(_one_seed, work, jobs)


def _one_seed(config, own, policy, supervised):
    names, places = [fault.name for fault in all_faults(config.supervision)], (*PHASES, Phase.LIFT.value)
    with SimulatedRig(config, ready_pose(config)) as rig:
        bench = Bench(config, rig, policy, supervised=supervised)
        phases, runs = bench.ticks(own[0].seed), []
        for case in own:
            ticks = phases.get(case.phase) or (0,)
            place = (case.seed, names.index(case.fault.name), places.index(case.phase))
            index = int(np.random.default_rng(np.random.SeedSequence(place)).integers(len(ticks)))
            runs.append(bench.run(case.fault, case.phase, ticks[index], case.seed))
    return runs
