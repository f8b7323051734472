"""A task that passes everything through and keeps what it saw, for tests of the loop over it."""

from collections.abc import Callable
from typing import Any

from palpate.core.control_loop import run_trial
from palpate.core.policy import Observation
from palpate.core.ports import CommandReason, JointCommand, Snapshot
from palpate.core.trial import Outcome, TrialSetup
from tests.unit.core.fake_world import FakeWorld, FollowTorque, Pit, build_task

SETUP = TrialSetup(0, 1, (1e-3, 1e-3))
HOLE = Pit(0.0, 0.0)


class Watch:
    """A task that passes everything through and keeps the snapshots and commands."""

    def __init__(self, world: FakeWorld, policy: FollowTorque | None = None) -> None:
        self._task = build_task(policy or FollowTorque())
        self._world = world
        self.snapshots: list[Snapshot] = []
        self.commands: list[JointCommand] = []
        self.on_step: Callable[[int], None] = lambda tick: None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._task, name)

    def sense(self, snapshot: Snapshot) -> Observation | None:
        self.on_step(snapshot.tick)
        self.snapshots.append(snapshot)
        return self._task.sense(snapshot)

    def act(self) -> JointCommand:
        self.commands.append(self._task.act())
        return self.commands[-1]


def run(world: FakeWorld, watch: Watch) -> Outcome | None:
    return run_trial(watch, world.ports, SETUP).outcome  # type: ignore[arg-type]


def assert_stopped(world: FakeWorld) -> None:
    """The arm holds still and takes no command."""
    here = world.arm.position_rad()
    applied = world.arm.send(JointCommand(tuple(q + 1e-3 for q in here)))
    world.clock.advance(10)
    assert applied.reason is CommandReason.STOPPED
    assert world.arm.position_rad() == here
