"""A what-if that goes on in the simulator from the first command that is not the recorded one.

The simulator's state at that tick is not read from the log but reached again: from the trial's start the simulator gets
the recorded commands, which up to there are also the core's own. MuJoCo is deterministic, so this restores all of it -
integration state, sensor history, noise, contacts - and every sample on the way is held against the recorded one, so
that nobody needs to take it on trust.
"""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from palpate.adapters.experiments import ScoredTrial, score, truth_fields
from palpate.adapters.log import TrialLog, TrialRecorder, config_of, world_of
from palpate.adapters.mujoco import SimulatedRig
from palpate.adapters.replay.differences import same_bits
from palpate.adapters.replay.rebuild import Rebuilt
from palpate.adapters.replay.tape import Tape
from palpate.core.control_loop import LoopObserver, run_trial
from palpate.core.errors import LogError
from palpate.core.ports import (
    SIMULATOR,
    AppliedCommand,
    ArmCommand,
    Clock,
    DeviceDecorator,
    JointCommand,
    JointSample,
    Ports,
    SensorDecorator,
    World,
    WrenchSample,
)


class WhatIfRecording:
    """Records one what-if, or nothing.

    Attributes:
        truth: Fields of the end record that only a simulator can fill; to be set before the trial is left.
    """

    def __init__(self, recorder: TrialRecorder | None = None, name: str = "") -> None:
        self._recorder, self._name = recorder, name
        self.truth: dict[str, Any] = {}

    @contextmanager
    def of(self, tape: Tape, rebuilt: Rebuilt, world: World) -> Iterator[tuple[LoopObserver, ...]]:
        """While inside, the trial runs; gives who has to observe it."""
        recorder, log = self._recorder, tape.log
        if recorder is None:
            yield ()
            return
        recorder.of(
            "what-if", rebuilt.config, rebuilt.ready, rebuilt.task, rebuilt.perception, rebuilt.policy,
            name=rebuilt.comparator, frozen=rebuilt.frozen, derived_from=log.path,
        )  # fmt: skip

        def left() -> bool:
            return tape.differences.first_command_tick is not None

        try:
            yield (recorder.begin(rebuilt.setup, world, self._name, left),)
        except BaseException as error:
            recorder.fail(rebuilt.task.report, error)
            raise
        recorder.end(rebuilt.task.report, self.truth)


def continue_in_mujoco(tape: Tape, rebuilt: Rebuilt, recording: WhatIfRecording) -> ScoredTrial:
    """Run the trial in the simulator, on the recorded path for as long as the core gives the recorded commands.

    Raises:
        LogError: The log did not come from the simulator, or this simulator does not give its samples again.
    """
    log = tape.log
    facts = _simulator_facts(log)
    config = config_of(log)
    with SimulatedRig(config, rebuilt.ready) as rig:
        rig.set_clock_ticks(facts["ticks"])
        rig.prepare(rebuilt.setup.index)
        world = rig.world().facts
        if world["model_sha256"] != facts.get("model_sha256"):
            problem = "this simulator's model is not the one that recorded"
            raise LogError(
                log.path, "/start", problem, "use the versions that recorded it, or leave --continue-in-mujoco"
            )
        path = _Path(tape)
        inner = rig.ports
        ports = Ports(
            _Clock(inner.clock, path),
            SensorDecorator(inner.force_sensor, path.wrench),
            SensorDecorator(inner.joint_encoder, path.joints),
            _Arm(inner.arm, path),
        )
        with recording.of(tape, rebuilt, world_of(rig)) as observers:
            report = run_trial(rebuilt.task, ports, rebuilt.setup, rebuilt.supervisor, observers)
            scored = score(rebuilt.config, report, rig.truth())
            recording.truth = truth_fields(scored)
        return scored


def _simulator_facts(log: TrialLog) -> dict[str, Any]:
    if log.start.world != SIMULATOR:
        raise LogError(
            log.path, "", f"came from {log.start.world or 'an unknown world'!r}", "only the simulator can go on"
        )
    facts: Any = json.loads(log.start.world_json)
    if not isinstance(facts, dict) or not isinstance(facts.get("ticks"), int):
        raise LogError(log.path, "/start", "does not say at which time the simulator was", "it was altered")
    return facts


class _Path:
    """The recorded path, followed until the core leaves it."""

    def __init__(self, tape: Tape) -> None:
        self.tape = tape

    @property
    def left(self) -> bool:
        """Whether a command was not the recorded one."""
        return self.tape.differences.first_command_tick is not None

    def wrench(self, sample: WrenchSample) -> WrenchSample:
        """A sample of the simulator's sensor."""
        if not self.left:
            recorded = self.tape.wrenches.next()
            same = same_bits((*sample.force_N, *sample.torque_Nm), (*recorded.force_N, *recorded.torque_Nm))
            self.require(same and sample.sequence == recorded.sequence, "wrench")
        return sample

    def joints(self, sample: JointSample) -> JointSample:
        """A sample of the simulator's encoders."""
        if not self.left:
            self.require(same_bits(sample.position_rad, self.tape.joints.next().position_rad), "joint angle")
        return sample

    def require(self, same: bool, what: str) -> None:
        """Make sure that the simulator gave what was recorded."""
        if not same:
            tick = max(self.tape.tick, 0)
            problem = f"this simulator gives another {what} than was recorded, under the same commands"
            remedy = "another processor or other versions recorded it; replay it without --continue-in-mujoco"
            raise LogError(self.tape.log.path, f"tick {tick}", problem, remedy)


class _Clock(Clock):
    def __init__(self, clock: Clock, path: _Path) -> None:
        self._clock, self._path = clock, path

    def now_ns(self) -> int:
        now = self._clock.now_ns()
        if not self._path.left:
            self._path.require(now == self._path.tape.clock.next(), "time")
        return now

    def sleep_until(self, deadline_ns: int) -> None:
        path = self._path
        path.tape.tick += 1
        if not path.left:
            path.tape.check_deadline(deadline_ns)
        if path.tape.at_tick is not None:
            path.tape.at_tick(path.tape.tick)
        self._clock.sleep_until(deadline_ns)


class _Arm(DeviceDecorator, ArmCommand):
    def __init__(self, arm: ArmCommand, path: _Path) -> None:
        super().__init__(arm)
        self._arm, self._path = arm, path

    def send(self, command: JointCommand) -> AppliedCommand:
        path = self._path
        recorded = None if path.left else path.tape.sends.next()
        if recorded is not None:
            path.tape.check_command(recorded, command.position_rad)
        applied = self._arm.send(command)
        if recorded is not None and not path.left:
            path.require(same_bits(applied.position_rad, recorded.applied.position_rad), "applied command")
        return applied

    def stop(self) -> None:
        self._arm.stop()
