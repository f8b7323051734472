"""A trial with faults injected at its ports, and its log."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from palpate.adapters.config import overlay, scenario
from palpate.adapters.experiments import (
    baseline,
    build_perception,
    build_supervisor,
    build_task,
    open_rig,
    ready_pose,
    score,
    trial_setup,
    truth_fields,
)
from palpate.adapters.log import TrialRecorder, world_of
from palpate.core.control_loop import LoopObserver, run_trial
from palpate.core.errors import DeviceError, PalpateError
from palpate.core.ports import AppliedCommand, ArmCommand, CommandReason, DeviceDecorator, ForceSensor, WrenchKind
from palpate.core.supervision import weaker_settings
from tests.support.faults import FaultPlan, faulty
from tests.support.memory_sink import MemorySink

_MAX_AGE_NS = 10**12
"""Ports do not mark delayed samples as stale: the supervisor has to notice."""


@dataclass(frozen=True)
class FaultScenario:
    """One trial of the simulated cell.

    Attributes:
        shows: Outcome and trip reason that the log must have, as ``record.shown`` returns them.
        faults: Fault plans at the ports.
        settings: Settings over those that all scenarios share.
        at: Tick, and the event from outside the core in it: ``stop``, ``interrupt`` or ``abort``.
        answers: By tick, the command that the arm reports as applied: a joint, its angle in rad, and the reason.
        tared_from: Tick from which the force sensor marks its samples as tared.
        ahead: By tick, the time added to the force sample's own, ns.
        policy: Name of the baseline.
        trial: Index of the trial.
    """

    shows: str
    faults: tuple[Mapping[str, Any], ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)
    at: tuple[int, str] | None = None
    answers: Mapping[int, tuple[int, float, CommandReason]] = field(default_factory=dict)
    tared_from: int | None = None
    ahead: Mapping[int, int] = field(default_factory=dict)
    policy: str = "torque"
    trial: int = 0


class _AnsweringArm(DeviceDecorator, ArmCommand):
    """Arm that reports another applied command in some ticks."""

    def __init__(self, arm, answers):
        super().__init__(arm)
        self._arm, self._answers, self._sends = arm, answers, -1

    def send(self, command):
        self._sends += 1
        applied = self._arm.send(command)
        if self._sends not in self._answers:
            return applied
        joint, angle_rad, reason = self._answers[self._sends]
        angles = list(command.position_rad if reason is CommandReason.AS_REQUESTED else applied.position_rad)
        angles[joint] = angle_rad
        return AppliedCommand(tuple(angles), reason)

    def stop(self):
        self._arm.stop()


class _OddSensor(DeviceDecorator, ForceSensor):
    """Force sensor that marks samples as tared, or whose clock is ahead in some ticks."""

    def __init__(self, sensor, one):
        super().__init__(sensor)
        self._sensor, self._first, self._ahead, self._reads = sensor, one.tared_from, one.ahead, -1

    def read(self):
        self._reads += 1
        sample = self._sensor.read()
        if self._reads in self._ahead:
            return replace(sample, source_time_ns=sample.source_time_ns + self._ahead[self._reads])
        tared = self._first is not None and self._reads >= self._first
        return replace(sample, kind=WrenchKind.TARED) if tared else sample


class _Outside(LoopObserver):
    """Events from outside the core."""

    def __init__(self, at, rig, task):
        self._at, self._rig, self._task = at, rig, task

    def waited(self, tick, deadline_ns):
        if self._at is None or tick != self._at[0]:
            return
        if self._at[1] == "stop":
            self._rig.ports.arm.stop()
        elif self._at[1] == "interrupt":
            self._task.interrupt()
        else:
            raise DeviceError("operator", "the run was ended")


def configured(one):
    """Return its settings: a short trial and a short retraction."""
    supervision = {"retract_mm": 0.5} | one.settings.get("supervision", {})
    table = {"task": {"time_limit_s": 0.5}, **one.settings}
    table["supervision"] = supervision | {"weakened": list(weaker_settings(supervision))}
    return overlay(replace(scenario("paper"), seed=17), table)


def recorded(one):
    """Run the trial and return its log."""
    config, sink = configured(one), MemorySink()
    ready = ready_pose(config)
    perception = build_perception(config)
    policy = baseline(one.policy, config, lambda: (0.0, 0.0))
    task = build_task(config, ready, perception, policy)
    setup = trial_setup(config, one.trial)
    plans = [FaultPlan(seed=1, **plan) for plan in one.faults]
    with open_rig(config, ready) as rig, TrialRecorder(sink, Path(), config.recording) as recorder:
        recorder.of("run", config, ready, task, perception, policy, name=one.policy)
        rig.prepare(one.trial)
        ports = faulty(rig.ports, plans, max_age_ns=_MAX_AGE_NS)
        arm, sensor = _AnsweringArm(ports.arm, one.answers), _OddSensor(ports.force_sensor, one)
        ports = replace(ports, arm=arm, force_sensor=sensor)
        observers = (recorder.begin(setup, world_of(rig), "trial"), _Outside(one.at, rig, task))
        try:
            report = run_trial(task, ports, setup, build_supervisor(config, ready, rig.sensor_facts), observers)
        except PalpateError as error:
            recorder.fail(task.report, error)
        else:
            recorder.end(report, truth_fields(score(config, report, rig.truth())))
    return sink.logs[0]
