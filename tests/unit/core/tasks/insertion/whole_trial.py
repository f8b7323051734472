"""Whole trials of the insertion task over bare ports, without a simulator."""

from palpate.core.control_loop import run_trial
from palpate.core.ports.values import CommandReason, JointCommand
from palpate.core.trial import TrialSetup
from tests.unit.core.fake_world import FollowTorque, Pit, build_task

HOLE = Pit(1.2e-3, -0.7e-3)
FAR_AWAY = Pit(0.03, 0.03)
START = (-1.0e-3, 1.0e-3)
EAST = (0.5e-3, 0.0)


class Trial:
    """One trial, run to its end, with a look at every tick."""

    def __init__(self, world, policy=None, start_m=START, config=None, *, on_step=None, task=None, index=0):
        self.world, self.policy = world, policy or FollowTorque()
        self.task = task or build_task(self.policy, config)
        self.snapshots = []
        self.commands = []
        self.phases = []
        self.tips = []
        self.forces = []
        self._on_step = on_step
        self.begin, self.choose, self.conclude = self.task.begin, self.task.choose, self.task.conclude
        with world:
            run_trial(self, world.ports, TrialSetup(index, 1, start_m))
            here = world.arm.position_rad()
            self.stopped = world.arm.send(JointCommand(here)).reason is CommandReason.STOPPED

    @property
    def report(self):
        return self.task.report

    def sense(self, snapshot):
        self.tips.append(self.world.tip_m)
        self.forces.append(self.world.force_N)
        seen = snapshot if self._on_step is None else self._on_step(snapshot.tick, snapshot)
        self.snapshots.append(seen)
        return self.task.sense(seen)

    def act(self):
        self.commands.append(self.task.act())
        self.phases.append(self.task.phase)
        return self.commands[-1]

    def events(self, name):
        return [event for event in self.report.events if event.name == name]

    def in_phase(self, phase):
        """Ticks at whose beginning the task was in this phase."""
        return [tick for tick in range(1, len(self.phases)) if self.phases[tick - 1] is phase]


def plus(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]
