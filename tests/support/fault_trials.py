"""Simulated trials with injected faults: the list of faults, one trial with one of them, and its verdict."""

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from math import tau
from typing import Any

import numpy as np
from typing_extensions import override

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
from palpate.core.ports import (
    CONTROL_RATE_HZ,
)
from palpate.core.trial import Outcome, Phase
from tests.support.faults import FaultPlan, FaultyArm, faulty
from tests.support.tool import TOOL

HARDWARE_LIMIT_N = 60.0
"""A true force above this counts as damage: the paper's sensor saturates there."""
PHASES = tuple(phase.value for phase in (Phase.TRANSFER, Phase.SETTLE, Phase.APPROACH, Phase.EXPLORE, Phase.INSERT))
"""Phases in which a fault can strike in every trial of an insertion."""
_LATE_TICKS = 3
"""Ticks that a stop may take after the first sign of a fault."""


@dataclass(frozen=True)
class Fault:
    """One fault.

    Attributes:
        plans: Fields of its plans, without tick and seed; more than one where faults come together.
        silent_ticks: Ticks that pass before a port can show it. None where that depends on the arm's motion: then only
            harm counts.
        plausible: Whether every single sample could be true.
        adversarial: Whether no physical mechanism causes it.
        noise_share: Noise added to the force sensor, as a share of the sensor's own.
    """

    name: str
    plans: tuple[Mapping[str, Any], ...]
    silent_ticks: int | None = None
    plausible: bool = False
    adversarial: bool = False
    noise_share: float = 0.0

    def at(self, tick, seed, sensor):
        """Return the plans for a fault that begins at a tick."""
        noise = [
            {"kind": "noise", "port": "force_sensor", "magnitude": self.noise_share * deviation, "channels": channels}
            for deviation, channels in ((sensor.noise_N, (0, 1, 2)), (sensor.noise_Nm, (3, 4, 5)))
            if self.noise_share * deviation > 0.0
        ]
        return [
            FaultPlan(first_tick=tick, seed=seed + number, **plan) for number, plan in enumerate((*self.plans, *noise))
        ]


def device_faults(config):
    """List faults of every kind on every port."""
    quiet_ticks, faults = config.max_repeats, list[Fault]()

    def add(name, silent_ticks, *, plausible=False, **plan):
        faults.append(Fault(name, (plan,), silent_ticks, plausible))

    for port in ("force_sensor", "joint_encoder"):
        add(f"{port} drops all", quiet_ticks, kind="drop", port=port)
        add(f"{port} drops one in three", None, kind="drop", port=port, probability=0.33)
        add(f"{port} 3 ticks late", None, kind="delay", port=port, delay_ticks=3)
        add(f"{port} half a second late", quiet_ticks, kind="delay", port=port, delay_ticks=70)
        add(f"{port} duplicates", None, kind="duplicate", port=port, probability=0.5)
        add(f"{port} repeats", quiet_ticks, kind="repeat", port=port)
        add(f"{port} not a number", 0, kind="nan", port=port)
        add(f"{port} disconnected", 0, kind="disconnect", port=port)
    force = {"port": "force_sensor"}
    axial = {**force, "channels": (2,)}
    joints = {"port": "joint_encoder"}
    add("force_sensor frozen", config.max_equal_samples, kind="freeze", **force)
    add("force_sensor drifts 5 N/s", None, plausible=True, kind="bias-drift", magnitude=5.0, **axial)
    add("force_sensor spike 100 N", 0, kind="spike", magnitude=100.0, duration_ticks=1, **axial)
    add("force_sensor saturated, marked", 0, kind="saturate", magnitude=2.0, **force)
    add("force_sensor saturated, not marked", None, plausible=True, kind="saturate", magnitude=2.0, honest=False,
        **force)  # fmt: skip
    add("force_sensor in grams", None, kind="unit", factor=1000.0, **force)
    add("force_sensor in kgf", None, plausible=True, kind="unit", factor=1.0 / 9.80665, **force)
    add("joint_encoder frozen", None, kind="freeze", **joints)
    add("joint_encoder drifts 2 mrad/s", None, plausible=True, kind="bias-drift", magnitude=2e-3, channels=(2,),
        **joints)  # fmt: skip
    add("joint_encoder spike 0.1 rad", 0, kind="spike", magnitude=0.1, channels=(1,), **joints)
    add("joint_encoder in degrees", 0, kind="unit", factor=57.29577951308232, **joints)
    add("arm loses all commands", None, kind="drop", port="arm")
    add("arm loses one command in three", None, kind="drop", port="arm", probability=0.33)
    add("arm 3 ticks late", None, kind="delay", port="arm")
    add("arm not a number", 0, kind="nan", port="arm")
    add("arm disconnected", 0, kind="disconnect", port="arm")
    add("arm stuck", None, kind="stuck", port="arm")
    add("arm in degrees", None, kind="unit", port="arm", factor=57.29577951308232)
    add("clock jumps 1 s", 0, kind="clock-jump", port="clock", time_s=1.0)
    add("ticks take 0.1 s", 0, kind="overrun", port="clock", time_s=0.1)
    add("ticks take 10 ms longer", None, kind="overrun", port="clock", time_s=0.01, probability=0.2)
    return faults


def sensor_faults():
    """List faults whose every sample could be true, alone and two at once; each lasts to the end of the trial."""
    force, joints = {"port": "force_sensor"}, {"port": "joint_encoder"}
    frozen, turned = {"kind": "freeze"} | force, {"kind": "unit", "factor": -1.0} | force
    repeated = {"kind": "repeat", "honest": False} | force
    second = repeated | {"span_ticks": 140}
    lag, late = {"kind": "lag", "time_s": 1e-3}, {"kind": "lag", "honest": False} | force
    turn, drift = {"kind": "offset"} | joints, {"kind": "bias-drift", "magnitude": 2e-3, "channels": (2,)} | joints
    channels = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
    return [
        _sensor_fault("dead with 0.06 of its noise", frozen, noise_share=0.06),
        _sensor_fault("dead with its own noise", frozen, noise_share=1.0),
        *(_sensor_fault(f"{name} frozen", frozen | {"channels": (k,)}) for k, name in enumerate(channels)),
        _sensor_fault("dishonest repeat of 0.1 s", repeated, adversarial=True),
        _sensor_fault("dishonest repeat of 1 s", second, adversarial=True),
        *(_sensor_fault(f"force times {scale:g}", _scaled(scale)) for scale in (0.01, 0.1, 0.5, 2.0, 10.0, 100.0)),
        _sensor_fault("sign flipped", turned),
        _sensor_fault("Fz sign flipped", turned | {"channels": (2,)}),
        _sensor_fault("Fx and Fz swapped", _swapped(0, 2)),
        _sensor_fault("Fx and Fy, Tx and Ty swapped", _swapped(0, 1), _swapped(3, 4)),
        _sensor_fault("forces and torques swapped", _swapped(0, 3), _swapped(1, 4), _swapped(2, 5)),
        _sensor_fault("force later by 1 ms a second", lag | force),
        _sensor_fault("force later by 1 ms a second, new times", lag | force | {"honest": False}),
        _sensor_fault("encoder later by 1 ms a second", lag | joints),
        _sensor_fault("encoder later by 1 ms a second, new times", lag | joints | {"honest": False}),
        _sensor_fault("encoder 2 off by a turn", turn | {"magnitude": tau, "channels": (1,)}),
        _sensor_fault("encoder 6 off by a turn back", turn | {"magnitude": -tau, "channels": (5,)}),
        _sensor_fault("force times 0.5 and 1 ms a second later", _scaled(0.5), lag | force),
        _sensor_fault("sign flipped and times 0.1", turned, _scaled(0.1)),
        _sensor_fault("dead with its own noise, encoder 6 off by a turn", frozen,
                      turn | {"magnitude": tau, "channels": (5,)}, noise_share=1.0),
        _sensor_fault("dead with its own noise, encoder 3 drifts 2 mrad/s", frozen, drift, noise_share=1.0),
        _sensor_fault("force times 0.1, encoder 3 drifts 2 mrad/s", _scaled(0.1), drift),
        _sensor_fault("Fz frozen, Fx and Fy swapped", frozen | {"channels": (2,)}, _swapped(0, 1)),
        _sensor_fault("dishonest repeat of 1 s, times 0.5", second, _scaled(0.5), adversarial=True),
        _noisy("dishonest repeat of 1 s", second, adversarial=True),
        _noisy("dishonest repeat of 1 s, times 0.3", second, _scaled(0.3), adversarial=True),
        _noisy("dishonest repeat of 1 s, sign flipped", second, turned, adversarial=True),
        _noisy("dishonest repeat of 0.1 s", repeated, adversarial=True),
        _noisy("force times 0.01", _scaled(0.01)),
        _noisy("force times 0.1", _scaled(0.1)),
        _noisy("dead with three times its noise", frozen, share=3.0),
        _sensor_fault("force later by 0.2 s a second, new times", late | {"time_s": 0.2}),
        _sensor_fault("torques times 0.1", *(_scaled(0.1) | {"channels": (k,)} for k in (3, 4, 5))),
        *(
            _noisy(
                f"back by {ticks / CONTROL_RATE_HZ:g} s at once",
                {"kind": "delay", "honest": False, "delay_ticks": ticks} | force,
                adversarial=True,
            )
            for ticks in (21, 42, 70)
        ),
    ]  # fmt: skip


def _sensor_fault(name, *plans, adversarial=False, noise_share=0.0):
    return Fault(name, plans, plausible=True, adversarial=adversarial, noise_share=noise_share)


def _noisy(name, *plans, adversarial=False, share=1.0):
    return _sensor_fault(f"{name}, fresh noise", *plans, adversarial=adversarial, noise_share=share)


def _scaled(factor):
    return {"kind": "unit", "port": "force_sensor", "factor": factor}


def _swapped(one, other):
    return {"kind": "swap", "port": "force_sensor", "channels": (one, other)}


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
    """The result of a trial with a fault.

    Attributes:
        delivered: Whether the fault struck; a trial may end before.
        ticks_to_stop: Ticks from the delivery to the stop; None when the trial ended in the ordinary way.
        cause: Reason of the stop; empty when there was none.
        latched: Whether no further trial may begin until somebody acknowledges.
        safe_stop: Whether the arm was stopped at the end.
        peak_force_N: Largest true force.
        damage: Whether a true force was above ``HARDWARE_LIMIT_N``, or a joint outside its limits.
    """

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
    damage: bool
    verdict: Verdict


class _Course(LoopObserver):
    """Keeps the newest tick, and whether a joint was outside its limits."""

    def __init__(self, kinematics):
        self.tick, self.left_limits = 0, False
        self._lower_rad, self._upper_rad = kinematics.lower_rad.tolist(), kinematics.upper_rad.tolist()

    @override
    def waited(self, tick, deadline_ns):
        self.tick = tick

    @override
    def sent(self, snapshot, command, applied):
        inside = map(lambda low, q, high: low <= q <= high, self._lower_rad, applied.position_rad, self._upper_rad)
        self.left_limits = self.left_limits or not all(inside)


class Bench:
    """A simulated rig for trial after trial with faults.

    Args:
        supervised: False lets every command through.
    """

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
        course = _Course(Kinematics(arm_named(self.config.arm), TOOL))
        plans = fault.at(tick, seed, self._rig.sensor_facts)
        ports = faulty(self._rig.ports, plans, lambda moment: struck.append(course.tick))
        try:
            run_trial(task, ports, trial_setup(self.config, seed), supervisor, (course,))
        except PolicyError:
            raise
        except PalpateError as caught:
            error = caught
        report, truth = task.report, self._rig.truth()
        damage = truth.peak_force_N > HARDWARE_LIMIT_N or course.left_limits
        stop = _stop_tick(course.tick, supervisor, report.outcome, error)
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
            verdict = _verdict(fault, ticks, course.tick - struck[0], damage=damage, harmless=harmless)
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
            damage=damage,
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
    """Judge a trial in which the fault struck.

    Args:
        ticks: From the delivery to the stop; None if there was none.
        lived: Ticks from the delivery to the trial's end.
        damage: Whether a limit of the hardware was exceeded; a stop in time still counts as detected.
        harmless: Whether the true force stayed below the task's limit.
    """
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
