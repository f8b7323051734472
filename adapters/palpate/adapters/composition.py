"""The composition root: the one place where a configuration becomes objects that work together."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from math import sqrt
from pathlib import Path
from types import TracebackType
from typing import Final, Self

import numpy as np
import pinocchio as pin

from palpate.adapters.approach import Approach
from palpate.adapters.config import RunConfig
from palpate.adapters.hardware_rig import HardwareRig
from palpate.adapters.mujoco_ports import MujocoArm, MujocoClock, MujocoForceSensor, MujocoJointEncoder
from palpate.adapters.rig import SIMULATOR, Rig, World
from palpate.adapters.rig_file import RigFile
from palpate.adapters.state_memory import identifier
from palpate.adapters.timing import Stopwatch, timed_parts
from palpate.core.arms import arm_named
from palpate.core.cycle import Ports
from palpate.core.explorer import Explorer
from palpate.core.insertion import PERIOD_S, InsertionTask
from palpate.core.inverse_kinematics import InverseKinematics
from palpate.core.kinematics import Array, Kinematics, ToolGeometry
from palpate.core.measurement import Measurement
from palpate.core.perception import (
    GatedThresholds,
    Perception,
    SelectedChannels,
    SignalProcessor,
    Symboliser,
    Thresholds,
)
from palpate.core.policy import (
    Action,
    ActionPenalty,
    InternalEffort,
    Policy,
    RandomWalkPolicy,
    Reinforcement,
    compass_actions,
)
from palpate.core.supervision import SensorFacts, Supervisor, require_fitting
from palpate.core.task_config import CONTROL_RATE_HZ, N_PER_KGF
from palpate.core.task_frame import goal_in_base
from palpate.core.tip_motion import TipMotion
from palpate.simulation.cell import Truth, WorkCell

APPROACH_HEIGHT_M: Final = 0.1
"""Height above the plate by which an arm on its way to the ready pose passes."""


@dataclass(frozen=True)
class ReadyPose:
    """The pose above the nominal goal from which trials begin.

    Attributes:
        q_rad: Joint angles, (n,).
        tip_rotation: Orientation of the tool there, (3, 3), base frame; it is kept during the trial.
    """

    q_rad: Array
    tip_rotation: Array


def wander_m(config: RunConfig) -> float:
    """How far from the nominal goal a trial may lead the peg: to a corner of the exploration area."""
    centre_mm = config.task.start_uncertainty_mm if config.task.area_centre == "start" else 0.0
    return (centre_mm + sqrt(2.0) * config.task.area_half_width_mm) * 1e-3


def find_ready_pose(config: RunConfig) -> ReadyPose:
    """Solve for the ready pose, tool pointing into the hole, its yaw left to the arm.

    Raises:
        UnreachableError: The arm cannot get there, or not to the corners of the exploration area.
    """
    arm = arm_named(config.arm)
    kinematics = Kinematics(arm, ToolGeometry())
    inverse = InverseKinematics(kinematics, PERIOD_S)
    goal = goal_in_base(config.task.goal)

    def at(x: float, y: float, z: float, rotation: Array) -> pin.SE3:
        return pin.SE3(rotation, goal.act(np.array([x, y, z])))

    height = config.task.ready_height_mm * 1e-3
    q = inverse.solve(
        at(0.0, 0.0, -height, goal.rotation),
        free_yaw=True,
        seed_rad=np.array(arm.posture_rad),
        field="task.goal",
    )
    kinematics.update(q)
    ready = ReadyPose(q, kinematics.tip_rotation.copy())
    reach = wander_m(config) / sqrt(2.0)
    for x in (-reach, reach):
        for y in (-reach, reach):
            for z in (-height, config.task.insertion_depth_mm * 1e-3):
                inverse.solve(at(x, y, z, ready.tip_rotation), free_yaw=False, seed_rad=q, field="task.goal")
    return ready


def find_approach(config: RunConfig, ready: ReadyPose) -> Approach:
    """The way to the ready pose for an arm that comes from anywhere: clear of the plate, well above it, down to it.

    Raises:
        UnreachableError: The arm cannot get there.
    """
    inverse = InverseKinematics(Kinematics(arm_named(config.arm), ToolGeometry()), PERIOD_S)
    goal = goal_in_base(config.task.goal)
    above = goal.act(np.array([0.0, 0.0, -APPROACH_HEIGHT_M]))
    q = inverse.solve(pin.SE3(ready.tip_rotation, above), free_yaw=False, seed_rad=ready.q_rad, field="task.goal")
    poses = tuple(q.tolist()), tuple(ready.q_rad.tolist())
    return Approach(arm_named(config.arm), goal, config.task.ready_height_mm * 1e-3, poses)


def task_actions(config: RunConfig) -> tuple[Action, ...]:
    """The compass steps that policies choose from."""
    return compass_actions(config.task.step_mm * 1e-3)


def build_perception(config: RunConfig) -> Perception:
    """Perception from task knowledge alone; stages that need fitting come from :mod:`palpate.adapters.fitting`."""
    p = config.perception
    position, torque = p.position_threshold_mm * 1e-3, p.torque_threshold_kgf_mm * 1e-3 * N_PER_KGF
    names = p.channels
    symboliser: Symboliser
    if p.symbols == "regions":
        symboliser = GatedThresholds(
            Thresholds(names[:2], ((-position, position),) * 2),
            Thresholds(names[2:], ((-torque, torque),) * 2),
        )
    else:
        symboliser = Thresholds(names, ((-position, position),) * 2 + ((-torque, torque),) * 2)
    return Perception(SelectedChannels(names), symboliser, identifier(p.memory, symboliser.symbols))


def build_reinforcement(config: RunConfig) -> Reinforcement:
    """What an action earns."""
    if config.learning.reinforcement == "effort":
        return InternalEffort(per_N_s=config.learning.effort_per_N_s, free_force_N=config.task.press_kgf * N_PER_KGF)
    return ActionPenalty()


def build_task(
    config: RunConfig,
    ready: ReadyPose,
    perception: Perception,
    policy: Policy,
    stopwatch: Stopwatch | None = None,
) -> InsertionTask:
    """The core, ready to run over any ports.

    Args:
        config: The run's configuration.
        ready: The ready pose.
        perception: From signals to states.
        policy: Chooses the actions.
        stopwatch: Times perceiving, deciding and control; None times nothing.
    """
    arm, goal = arm_named(config.arm), goal_in_base(config.task.goal)
    signal = SignalProcessor(
        CONTROL_RATE_HZ,
        config.perception.cutoff_Hz,
        config.perception.filter_order,
        config.perception.calibration,
    )
    measurement = Measurement(Kinematics(arm, ToolGeometry()), goal, signal)
    motion = TipMotion(Kinematics(arm, ToolGeometry()), goal, ready.tip_rotation, PERIOD_S)
    explorer = Explorer(perception, policy, build_reinforcement(config), PERIOD_S)
    if stopwatch is not None:
        timed_parts(measurement, explorer, motion, stopwatch)
    return InsertionTask(config.task, config.control, measurement, motion, explorer)


def build_supervisor(config: RunConfig) -> Supervisor:
    """The supervisor that stands between the task and the arm."""
    kinematics = Kinematics(arm_named(config.arm), ToolGeometry())
    # A cell without noise is a simulated one: there equal samples are no sign of anything.
    noisy = config.cell.sensor.force_noise_N > 0.0
    return Supervisor(config.supervision, config.task, kinematics, config.perception.calibration, noisy=noisy)


def require_usable(config: RunConfig, ready: ReadyPose) -> None:
    """Build a task once: some settings are refused only there, and better so before a folder is made.

    Raises:
        ConfigurationError: A setting is refused.
    """
    walk = RandomWalkPolicy(task_actions(config))
    build_task(config, ready, build_perception(RunConfig(task=config.task)), walk)
    sensor = config.cell.sensor
    facts = SensorFacts(force_noise_N=sensor.force_noise_N, torque_noise_Nm=sensor.torque_noise_Nm)
    kinematics = Kinematics(arm_named(config.arm), ToolGeometry())
    require_fitting(config.supervision, config.task, kinematics, ready.q_rad, facts)


def open_rig(config: RunConfig, ready: ReadyPose, rig_file: str = "") -> Rig:
    """The rig that trials run on, not yet entered: the simulator, or the devices of a rig file.

    Raises:
        ConfigurationError: The rig file or a setting in it cannot be used.
    """
    if not rig_file:
        return SimulatedRig(config, ready)
    return HardwareRig(RigFile.load(Path(rig_file)), config, find_approach(config, ready))


class SimulatedRig(Rig):
    """The MuJoCo work cell with its four ports. A context manager: on exit every device is closed.

    Attributes:
        ports: What the core runs over.
        cell: The work cell behind them, for scoring and for pictures.
        seed: Gives, with a trial's index, its hole and sensor errors; may be another from one trial to the next.
    """

    def __init__(self, config: RunConfig, ready: ReadyPose) -> None:
        kinematics = Kinematics(arm_named(config.arm), ToolGeometry())
        self.seed = config.seed
        self.cell = WorkCell(
            kinematics,
            config.cell,
            goal_in_base=goal_in_base(config.task.goal),
            ready_rad=ready.q_rad,
            rate_Hz=CONTROL_RATE_HZ,
            wander_m=wander_m(config),
        )
        clock = MujocoClock(self.cell)
        self._sensor = MujocoForceSensor(self.cell, clock)
        self._encoder = MujocoJointEncoder(self.cell, clock)
        self._arm = MujocoArm(
            self.cell,
            tuple(kinematics.lower_rad.tolist()),
            tuple(kinematics.upper_rad.tolist()),
            tuple(kinematics.velocity_limit_rad_s.tolist()),
        )
        self._model_sha256 = self.cell.model_sha256()
        self.ports = Ports(clock, self._sensor, self._encoder, self._arm)

    def prepare(self, trial: int) -> None:
        """Put the world into the state in which this trial starts, and free the arm from its last stop."""
        self._arm.deactivate()
        self._sensor.deactivate()
        self.cell.reset(self.seed, trial)
        self._sensor.activate()
        self._arm.activate()

    def world(self) -> World:
        """What a log must know of the trial that was just prepared, to set this cell up for it again."""
        return World(
            SIMULATOR,
            {
                "ticks": self.cell.ticks,
                "model_sha256": self._model_sha256,
                "hole_in_task_m": list(self.truth().hole_in_task_m),
            },
        )

    @property
    def clock_ticks(self) -> int:
        """Control ticks on the simulator's clock."""
        return self.cell.ticks

    def set_clock_ticks(self, ticks: int) -> None:
        """Set the simulator's clock."""
        self.cell.set_ticks(ticks)

    def truth(self) -> Truth:
        """What really happened; for scoring and comparators only."""
        return self.cell.truth()

    def __enter__(self) -> Self:
        with ExitStack() as opened:
            for device in (self._sensor, self._encoder, self._arm):
                opened.enter_context(device)
            # All are open: from here on closing them is __exit__'s affair, in the reverse order.
            self._opened = opened.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._arm.stop()
        self._opened.close()
