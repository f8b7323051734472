"""A task that passes everything through and keeps what it saw, for tests of the loop over it."""

from palpate.core.control_loop import run_trial
from palpate.core.ports import CommandReason, JointCommand
from palpate.core.trial import TrialSetup
from tests.unit.core.fake_world import FollowTorque, Pit, build_task

SETUP = TrialSetup(0, 1, (1e-3, 1e-3))
HOLE = Pit(0.0, 0.0)


class Watch:
    """A task that passes everything through and keeps the snapshots and commands."""

    def __init__(self, world, policy=None):
        self._task = build_task(policy or FollowTorque())
        self._world = world
        self.snapshots = []
        self.commands = []
        self.on_step = lambda tick: None

    def __getattr__(self, name):
        return getattr(self._task, name)

    def sense(self, snapshot):
        self.on_step(snapshot.tick)
        self.snapshots.append(snapshot)
        return self._task.sense(snapshot)

    def act(self):
        self.commands.append(self._task.act())
        return self.commands[-1]


def run(world, monitor):
    return run_trial(monitor, world.ports, SETUP).outcome


def assert_stopped(world):
    """The arm holds still and takes no command."""
    here = world.arm.position_rad()
    applied = world.arm.send(JointCommand(tuple(q + 1e-3 for q in here)))
    world.clock.advance(10)
    assert applied.reason is CommandReason.STOPPED
    assert world.arm.position_rad() == here
