"""A plate with a hole behind plain fake ports: enough of a world to run whole trials without a simulator.

The plate is a spring along z under the tip; a pit is a place where the plate lies deeper, and a tip that has dropped
into one is held by a lateral spring. A force of the plate comes with a torque about the tip that tells the direction
to the nearest pit, as the torque of a tilted peg does. The sensor carries weight and bias too, until it is tared.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from math import hypot

import numpy as np
import pinocchio as pin

from palpate.adapters.contracts import FakeClock
from palpate.core.motion import InverseKinematics, Kinematics, TipMotion, arm_named
from palpate.core.perception import (
    GatedThresholds,
    IdentityState,
    Perception,
    SelectedChannels,
    SignalProcessor,
    Thresholds,
)
from palpate.core.policy import Action, ActionPenalty, Decision, EpisodeOutcome, Policy, Transition, compass_actions
from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, Ports
from palpate.core.tasks.insertion import Agent, InsertionTask
from palpate.core.trial import N_PER_KGF, ControlConfig, GoalConfig, Measurement, TaskConfig, goal_in_base
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder
from tests.support.tool import TOOL

STIFFNESS_N_PER_M = 5e3
LATERAL_N_PER_M = 4e4
LEVER_M = 2e-3
WEIGHT_AND_BIAS_N = (0.7, -0.4, 6.0)
WEIGHT_AND_BIAS_NM = (0.05, -0.02, 0.01)
ACTIONS = compass_actions(0.5e-3)


@dataclass(frozen=True)
class Pit:
    """Where the plate lies deeper, within a radius; in m, task frame. One with walls holds the tip, with friction."""

    x_m: float
    y_m: float
    depth_m: float = 0.010
    radius_m: float = 0.3e-3
    walls: bool = True
    friction_N: float = 0.0
    friction_below_m: float = 0.0


@cache
def ready_pose(arm="zebra-zero"):
    """Joint angles 3 mm above the nominal goal, tool pointing into the hole, and the tool's orientation there."""
    kinematics = Kinematics(arm_named(arm), TOOL)
    goal = goal_in_base(GoalConfig())
    target = pin.SE3(goal.rotation, goal.act(np.array([0.0, 0.0, -3e-3])))
    seed = np.array(arm_named(arm).posture_rad)
    q = InverseKinematics(kinematics, PERIOD_S).solve(target, free_yaw=True, seed_rad=seed, field="place")
    kinematics.update(q)
    return tuple(q.tolist()), tuple(map(tuple, kinematics.tip_rotation.tolist()))


class PlateSensor(FakeForceSensor):
    """Feels the world below it at the moment it is read."""

    def __init__(self, world):
        super().__init__(world.clock)
        self._world = world

    def read(self):
        self.load_N, self.load_Nm = self._world.load()
        sample = super().read()
        return sample if self._world.spoil is None else self._world.spoil(sample)


class FakeWorld:
    """The plate, the arm and the four ports; a context manager that configures and activates them."""

    def __init__(self, *pits, height_m=0.0):
        self.clock = FakeClock()
        self.pits, self.height_m, self.slope = pits, height_m, 0.0
        self.stiffness_N_per_m = STIFFNESS_N_PER_M
        self._height_m = -3e-3
        self.spoil = None
        self.tip_m = (0.0, 0.0, 0.0)
        self.force_N = (0.0, 0.0, 0.0)
        self._inside = None
        self._held_N = 0.0
        self._kinematics = kinematics = Kinematics(arm_named("zebra-zero"), TOOL)
        self._task = goal_in_base(GoalConfig())
        home, _ = ready_pose()
        self.arm = FakeArm(
            self.clock,
            home,
            lower_rad=tuple(kinematics.lower_rad.tolist()),
            upper_rad=tuple(kinematics.upper_rad.tolist()),
            max_step_rad=PERIOD_S,
        )
        self.sensor = PlateSensor(self)
        self.encoder = FakeJointEncoder(self.clock, self.arm.position_rad)
        self.ports = Ports(self.clock, self.sensor, self.encoder, self.arm)

    def __enter__(self):
        for device in (self.sensor, self.encoder, self.arm):
            device.__enter__()
        return self

    def __exit__(self, kind, error, trace):
        for device in (self.arm, self.encoder, self.sensor):
            device.close()

    def load(self):
        """What the sensor carries now: contact, weight and bias, sensor frame."""
        kinematics = self._kinematics
        kinematics.update(self.arm.position_rad())
        x, y, z = self._task.actInv(kinematics.tip_position_m).tolist()
        self.tip_m = (x, y, z)
        force, torque = self._contact(x, y, z)
        self._height_m = z
        self.force_N = _plus(force, (0.0, 0.0, 0.0))
        to_sensor = kinematics.tip_rotation.T @ self._task.rotation
        force_in_sensor = to_sensor @ force
        lever = np.cross((0.0, 0.0, TOOL.tip_m[2]), force_in_sensor)
        torque_in_sensor = to_sensor @ torque + lever
        return _plus(force_in_sensor, WEIGHT_AND_BIAS_N), _plus(torque_in_sensor, WEIGHT_AND_BIAS_NM)

    def _contact(self, x, y, z):
        """Force on the tip and torque about it, task frame."""
        height = self.height_m + self.slope * x
        if z <= height:
            self._inside = None
        elif self._inside is None or not self._inside.walls:
            self._inside = next((p for p in self.pits if hypot(p.x_m - x, p.y_m - y) <= p.radius_m), None)
        pit = self._inside
        push = self.stiffness_N_per_m * max(z - height - (pit.depth_m if pit else 0.0), 0.0)
        if pit is None or not pit.walls:
            self._held_N = push
            return np.array([0.0, 0.0, -push]), self._cue(x, y, push)
        # The spring moves the peg once it bears more than friction holds.
        self._held_N += self.stiffness_N_per_m * (z - self._height_m)
        friction_N = pit.friction_N if z > pit.friction_below_m else 0.0
        self._held_N = min(max(self._held_N, -friction_N), friction_N)
        push = max(push, self._held_N) if push else self._held_N
        across = LATERAL_N_PER_M
        return np.array([across * (pit.x_m - x), across * (pit.y_m - y), -push]), np.zeros(3)

    def _cue(self, x, y, push):
        if not self.pits:
            return np.zeros(3)
        dx, dy = min(((p.x_m - x, p.y_m - y) for p in self.pits), key=lambda d: hypot(*d))
        far = max(hypot(dx, dy), 1e-9)
        return np.array([-dy / far, dx / far, 0.0]) * (LEVER_M * push)


def _plus(a, b):
    x, y, z = (a + np.array(b)).tolist()
    return x, y, z


@dataclass
class FollowTorque(Policy):
    """Steps where the torque about the tip points: -x torque means +y, +y torque means +x."""

    learned: list[Transition] = field(default_factory=list)
    ended: list[EpisodeOutcome] = field(default_factory=list)

    def begin_trial(self, trial, rng): ...

    def choose(self, observation):
        tx, ty, _ = observation.torque_Nm
        along = [ty * a.displacement_m[0] - tx * a.displacement_m[1] for a in ACTIONS]
        index = along.index(max(along))
        return Decision(ACTIONS[index], index, "torque")

    def learn(self, transition):
        self.learned.append(transition)

    def end_trial(self, episode):
        self.ended.append(episode)


@dataclass
class Steps(FollowTorque):
    """Takes given steps, in m, one after the other, and then stays."""

    displacements_m: Sequence[tuple[float, float]] = ()

    def choose(self, observation):
        n = observation.action_number
        step = self.displacements_m[n] if n < len(self.displacements_m) else (0.0, 0.0)
        return Decision(Action("given", step), None, "given")


def paper_perception():
    """The paper's 17 states."""
    torque = 0.7e-3 * N_PER_KGF
    symboliser = GatedThresholds(
        Thresholds(("x", "y"), ((-1e-3, 1e-3),) * 2), Thresholds(("tx", "ty"), ((-torque, torque),) * 2)
    )
    return Perception(SelectedChannels(("x", "y", "tx", "ty")), symboliser, IdentityState(symboliser.symbols))


def measurement():
    """The zebra-zero's, above the goal that comes with palpate."""
    signal = SignalProcessor(CONTROL_RATE_HZ, 4.0)
    kinematics = Kinematics(arm_named("zebra-zero"), TOOL)
    return Measurement(kinematics, goal_in_base(GoalConfig()), signal, STIFFNESS_N_PER_M)


def tip_motion():
    """The same arm's, the tool upright."""
    _, rotation = ready_pose()
    kinematics = Kinematics(arm_named("zebra-zero"), TOOL)
    return TipMotion(kinematics, goal_in_base(GoalConfig()), np.array(rotation), PERIOD_S)


def build_task(policy, task=None, control=None, reinforcement=None):
    """The core over the zebra-zero, with every part its own; the gripper is an ideal spring."""
    return InsertionTask(
        task or TaskConfig(),
        control or ControlConfig(moving_mass_kg=0.0, rigid_mass_kg=0.0),
        measurement(),
        tip_motion(),
        Agent(paper_perception(), policy, reinforcement or ActionPenalty(), PERIOD_S),
    )
