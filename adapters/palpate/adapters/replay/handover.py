"""What-ifs that continue in the simulator from the first command that differs from the recording.

The log does not contain the simulator's state at that tick. The recorded commands, which match the core's until then,
are therefore executed from the start of the trial. MuJoCo is deterministic, so this restores the complete
state (integration state, sensor history, noise, contacts), and every tick until then is compared with the recording.
"""

import json
from typing import Any

from typing_extensions import override

from palpate.adapters.experiments import ScoredTrial, score, truth_fields
from palpate.adapters.log import TrialLog, config_of, world_of
from palpate.adapters.mujoco import SimulatedRig
from palpate.adapters.replay.differences import same_bits
from palpate.adapters.replay.tape import Tape
from palpate.adapters.replay.trial import ReplayedTrial
from palpate.core.control_loop import LoopObserver
from palpate.core.errors import LogError
from palpate.core.ports import SIMULATOR, AppliedCommand, JointCommand, Snapshot
from palpate.core.trial import TrialReport


def continue_in_mujoco(trial: ReplayedTrial) -> ScoredTrial:
    """Run the trial in the simulator, on the recorded path until the core sends a different command.

    Raises:
        LogError: The log is not from the simulator, or this simulator does not reproduce its samples.
    """
    log, rebuilt = trial.tape.log, trial.rebuilt
    facts = _simulator_facts(log)
    with SimulatedRig(config_of(log), rebuilt.ready) as rig:
        rig.set_clock_ticks(facts["ticks"])
        rig.prepare(rebuilt.setup.index)
        if rig.world().facts["model_sha256"] != facts.get("model_sha256"):
            problem = "this simulator's model differs from the recording's"
            remedy = "use the versions that recorded it, or leave --continue-in-mujoco"
            raise LogError(log.path, "/start", problem, remedy)
        path = _RecordedPath(trial.tape)
        report = trial.run(
            rig.ports, world_of(rig), lambda report: truth_fields(score(rebuilt.config, report, rig.truth())), [path]
        )
        return score(rebuilt.config, report, rig.truth())


def _simulator_facts(log: TrialLog) -> dict[str, Any]:
    if log.start.world != SIMULATOR:
        world = log.start.world or "an unknown world"
        raise LogError(log.path, "", f"came from {world!r}", "only the simulator can continue it")
    facts: Any = json.loads(log.start.world_json)
    if not isinstance(facts, dict) or not isinstance(facts.get("ticks"), int):
        raise LogError(log.path, "/start", "does not say at which time the simulator was", "it was altered")
    return facts


class _RecordedPath(LoopObserver):
    """Observer that compares each tick with the recorded one until the core sends a different command."""

    def __init__(self, tape: Tape) -> None:
        self._tape = tape

    @override
    def begun(self, start_ns: int, report: TrialReport) -> None:
        self._require(start_ns == self._tape.clock.next(), "time")

    @override
    def waited(self, tick: int, deadline_ns: int) -> None:
        self._tape.tick = tick
        if self._tape.differences.first_command_tick is None:
            self._tape.check_deadline(deadline_ns)

    @override
    def sent(self, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> None:
        tape = self._tape
        if tape.differences.first_command_tick is not None:
            return
        wrench, joints = tape.wrenches.next(), tape.joints.next()
        self._require(snapshot.time_ns == tape.clock.next(), "time")
        self._require(snapshot.wrench == wrench, "wrench")
        self._require(same_bits(snapshot.joints.position_rad, joints.position_rad), "joint angle")
        answer = tape.next_answer(command.position_rad)
        if tape.differences.first_command_tick is None:
            self._require(same_bits(applied.position_rad, answer.position_rad), "applied command")

    def _require(self, same: bool, what: str) -> None:
        if not same:
            problem = f"this simulator gives another {what} than was recorded, under the same commands"
            remedy = "another processor or other versions recorded it; replay it without --continue-in-mujoco"
            raise LogError(self._tape.log.path, f"tick {self._tape.tick}", problem, remedy)
