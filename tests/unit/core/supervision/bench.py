"""A supervisor over synthetic ticks: an ideal arm, and members for every fault."""

from dataclasses import replace

from palpate.core.control_loop import tick_time_ns
from palpate.core.motion import Kinematics, arm_named
from palpate.core.ports.rig import SensorFacts
from palpate.core.ports.values import AppliedCommand, JointCommand, JointSample, Snapshot, WrenchSample
from palpate.core.supervision import SupervisionConfig, Supervisor
from palpate.core.tasks.insertion import INSERTION
from palpate.core.trial import PhaseConstraints, TaskConfig
from tests.unit.core.fake_world import TOOL, ready_pose

BIAS = (0.7, -0.4, 6.0, 0.05, -0.02, 0.01)
TOUCHING = PhaseConstraints(contact=True, bias=BIAS)
FREE = PhaseConstraints(contact=False, bias=BIAS)
UNTARED = PhaseConstraints(contact=True)
READY_TIP = (0.0, 0.0, -3e-3)


def supervisor(config=None, arm="zebra-zero", *, noisy=False, sensor=None, **more):
    """A supervisor for made-up wrenches, which have no noise."""
    kinematics = Kinematics(arm_named(arm), TOOL)
    return Supervisor(
        config or SupervisionConfig(),
        TaskConfig(),
        INSERTION.workspace(TaskConfig()),
        kinematics,
        sensor or (SensorFacts(0.1, 0.004) if noisy else SensorFacts(0.0, 0.0)),
        **{"scale": (1.0,) * 6, "axial_N_per_m": 1e3, **more},
    )


class Bench:
    """Ticks through a supervisor."""

    def __init__(self, config=None, arm="zebra-zero", **more):
        self.supervisor = supervisor(config, arm, **more)
        self.home_rad, _ = ready_pose(arm)
        self.snapshots = []
        self.results = []
        self.applied = None
        self.supervisor.begin()

    @property
    def here_rad(self):
        return self.home_rad if self.applied is None else self.applied.position_rad

    def snapshot(
        self,
        force_N=(0.0, 0.0, 0.0),
        torque_Nm=(0.0, 0.0, 0.0),
        measured_rad=None,
        *,
        wrench=None,
        joints=None,
        **changes,
    ):
        """The next tick, force and torque beyond the bias; the dictionaries and keywords change its fields."""
        tick = len(self.snapshots)
        now = tick_time_ns(0, tick)
        f = (BIAS[0] + force_N[0], BIAS[1] + force_N[1], BIAS[2] + force_N[2])
        t = (BIAS[3] + torque_Nm[0], BIAS[4] + torque_Nm[1], BIAS[5] + torque_Nm[2])
        made = Snapshot(
            tick,
            now,
            replace(WrenchSample(f, t, now, now, tick), **(wrench or {})),
            replace(JointSample(measured_rad or self.here_rad, now, now, tick), **(joints or {})),
            self.applied,
        )
        return made._replace(**changes)

    def tick(self, constraints=TOUCHING, requested_rad=None, tip_m=READY_TIP, **changes):
        """One tick with what :meth:`snapshot` takes; the arm does what the supervisor says."""
        seen = self.snapshot(**changes)
        done = self.supervisor.check(seen, JointCommand(requested_rad or self.here_rad), constraints, tip_m)
        self.snapshots.append(seen)
        self.results.append(done)
        self.applied = AppliedCommand(done.command.position_rad)
        if done.command_override is not None:
            self.applied = done.command_override.applied(self.applied)
        return done

    def trip(self, *args, **changes):
        """The trip of one tick with what :meth:`tick` takes."""
        self.tick(*args, **changes)
        return self.tripped

    @property
    def tripped(self):
        """What it has tripped by."""
        trip = self.supervisor.trip
        assert trip is not None
        return trip

    def clean(self, ticks, **changes):
        """So many ticks in which nothing may happen."""
        for _ in range(ticks):
            assert self.tick(**changes).command_override is None
        assert self.supervisor.trip is None
