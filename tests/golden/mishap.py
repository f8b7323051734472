"""A trial in which something goes wrong on purpose, and its log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from palpate.adapters.config import RunConfig, overlay, scenario
from palpate.adapters.experiments import (
    build_perception,
    build_supervisor,
    build_task,
    comparator,
    open_rig,
    ready_pose,
    score,
    trial_setup,
    truth_fields,
)
from palpate.adapters.log import TrialRecorder, world_of
from palpate.core.control_loop import LoopObserver, run_trial
from palpate.core.errors import DeviceError, PalpateError
from palpate.core.ports import (
    AppliedCommand,
    ArmCommand,
    CommandReason,
    DeviceDecorator,
    ForceSensor,
    JointCommand,
    JointEncoder,
    JointSample,
    JointVector,
    Rig,
    WrenchKind,
    WrenchSample,
)
from palpate.core.supervision import weaker_settings
from palpate.core.trial import Task
from tests.support.faults import FaultPlan, faulty
from tests.support.memory_sink import MemorySink

_FRESH_NS: Final = 10**12
"""What a fault holds back is not marked stale by its port: that is the supervisor's affair."""


@dataclass(frozen=True)
class Mishap:
    """One such trial.

    Attributes:
        faults: Plans of what goes wrong at the ports.
        settings: Over those that all of them have.
        at: Tick, and what happens outside of the core then: ``stop``, ``interrupt`` or ``abort``.
        answers: By tick, what the arm says that it applied: a joint, its angle in rad, and why.
        tared_from: Tick from which the force sensor says that its samples are tared.
        ahead: By tick, how much later than its own the time is that a force sample has, ns.
        policy: Name of the comparator.
        trial: Index of the trial.
        placed: The first joint sample is the ready pose in every bit.
        max_age_ns: Age above which the ports mark a sample that a fault holds back.
    """

    faults: tuple[Mapping[str, Any], ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)
    at: tuple[int, str] | None = None
    answers: Mapping[int, tuple[int, float, CommandReason]] = field(default_factory=dict)
    tared_from: int | None = None
    ahead: Mapping[int, int] = field(default_factory=dict)
    policy: str = "torque"
    trial: int = 0
    placed: bool = False
    max_age_ns: int = _FRESH_NS


class _Answering(DeviceDecorator, ArmCommand):
    """An arm that says in some ticks that it applied something else."""

    def __init__(self, arm: ArmCommand, answers: Mapping[int, tuple[int, float, CommandReason]]) -> None:
        super().__init__(arm)
        self._arm, self._answers, self._sends = arm, answers, -1

    def send(self, command: JointCommand) -> AppliedCommand:
        self._sends += 1
        applied = self._arm.send(command)
        if self._sends not in self._answers:
            return applied
        joint, angle_rad, reason = self._answers[self._sends]
        angles = list(command.position_rad if reason is CommandReason.AS_ASKED else applied.position_rad)
        angles[joint] = angle_rad
        return AppliedCommand(tuple(angles), reason)

    def stop(self) -> None:
        self._arm.stop()


class _Odd(DeviceDecorator, ForceSensor):
    """A force sensor that says from some sample on that it tares, and whose clock is ahead in some ticks."""

    def __init__(self, sensor: ForceSensor, mishap: Mishap) -> None:
        super().__init__(sensor)
        self._sensor, self._first, self._ahead, self._reads = sensor, mishap.tared_from, mishap.ahead, -1

    def read(self) -> WrenchSample:
        self._reads += 1
        sample = self._sensor.read()
        if self._reads in self._ahead:
            return replace(sample, source_time_ns=sample.source_time_ns + self._ahead[self._reads])
        told = self._first is not None and self._reads >= self._first
        return replace(sample, kind=WrenchKind.TARED) if told else sample


class _Placed(DeviceDecorator, JointEncoder):
    """Encoders that give a certain pose first."""

    def __init__(self, encoder: JointEncoder, first_rad: JointVector) -> None:
        super().__init__(encoder)
        self._encoder, self._first_rad = encoder, first_rad

    def read(self) -> JointSample:
        sample, first_rad = self._encoder.read(), self._first_rad
        self._first_rad = ()
        return replace(sample, position_rad=first_rad) if first_rad else sample


class _Outside(LoopObserver):
    """What befalls a trial from outside of the core."""

    def __init__(self, mishap: Mishap, rig: Rig, task: Task) -> None:
        self._at, self._rig, self._task = mishap.at, rig, task

    def waited(self, tick: int, deadline_ns: int) -> None:
        if self._at is None or tick != self._at[0]:
            return
        if self._at[1] == "stop":
            self._rig.ports.arm.stop()
        elif self._at[1] == "interrupt":
            self._task.interrupt()
        else:
            raise DeviceError("operator", "the run was ended")


def configured(mishap: Mishap) -> RunConfig:
    """Its settings: short, and drawn back by little."""
    supervision = {"retract_mm": 0.5} | mishap.settings.get("supervision", {})
    table = {"task": {"time_limit_s": 0.5}, **mishap.settings}
    table["supervision"] = supervision | {"weakened": list(weaker_settings(supervision))}
    return overlay(replace(scenario("paper"), seed=17), table)


def recorded(mishap: Mishap) -> bytes:
    """The log of the trial."""
    config, sink = configured(mishap), MemorySink()
    ready = ready_pose(config)
    perception = build_perception(config)
    policy = comparator(mishap.policy, config, lambda: (0.0, 0.0))
    task = build_task(config, ready, perception, policy)
    setup = trial_setup(config, mishap.trial)
    plans = [FaultPlan(seed=1, **plan) for plan in mishap.faults]
    with open_rig(config, ready) as rig, TrialRecorder(lambda: sink, Path(), config.recording) as recorder:
        recorder.of("run", config, ready, task, perception, policy, name=mishap.policy)
        rig.prepare(mishap.trial)
        ports = faulty(rig.ports, plans, max_age_ns=mishap.max_age_ns)
        arm, sensor = _Answering(ports.arm, mishap.answers), _Odd(ports.force_sensor, mishap)
        encoder = _Placed(ports.joint_encoder, tuple(ready.q_rad.tolist()) if mishap.placed else ())
        ports = replace(ports, arm=arm, force_sensor=sensor, joint_encoder=encoder)
        observers = (recorder.begin(setup, world_of(rig), "mishap"), _Outside(mishap, rig, task))
        try:
            report = run_trial(task, ports, setup, build_supervisor(config, ready, rig.sensor_facts), observers)
        except PalpateError as error:
            recorder.fail(task.report, error)
        else:
            recorder.end(report, truth_fields(score(config, report, rig.truth())))
    return sink.logs[0]
