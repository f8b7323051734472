"""The simulated work cell as a rig."""

from contextlib import ExitStack
from types import TracebackType
from typing import Self

from typing_extensions import override

from palpate.adapters.config import RunConfig, require_corners, simulated_noise
from palpate.adapters.mujoco.ports import MujocoArm, MujocoClock, MujocoForceSensor, MujocoJointEncoder
from palpate.core.motion import Kinematics, arm_named
from palpate.core.ports import CONTROL_RATE_HZ, SIMULATOR, FaultLatch, GroundTruth, Ports, Rig, SensorFacts, WorldRecord
from palpate.core.trial import ReadyPose, goal_in_base, wander_m
from palpate.simulation.work_cell import HiddenValues, WorkCell


class SimulatedRig(Rig):
    """The MuJoCo work cell with its four ports. On exit from its context, every device is closed.

    Together with the trial number, ``seed`` determines the hole and the sensor errors. It may change between trials.
    """

    simulated = True

    def __init__(self, config: RunConfig, ready: ReadyPose, hidden: HiddenValues | None = None) -> None:
        self.seed, self.latch, self._hidden = config.seed, FaultLatch(), hidden
        self._build(config, ready)

    def _build(self, config: RunConfig, ready: ReadyPose) -> None:
        require_corners(config)
        hidden, kinematics = self._hidden, Kinematics(arm_named(config.arm), config.tool.geometry)
        self._facts = simulated_noise(config)
        self.cell = WorkCell(
            kinematics,
            config.cell if hidden is None else hidden.cell(config.cell),
            goal_in_base=goal_in_base(config.task.goal),
            ready_rad=ready.q_rad,
            rate_Hz=CONTROL_RATE_HZ,
            wander_m=wander_m(config.task),
            hidden=hidden,
        )
        self._sensor = MujocoForceSensor(self.cell)
        self._encoder = MujocoJointEncoder(self.cell)
        self._arm = MujocoArm(
            self.cell,
            tuple(kinematics.lower_rad.tolist()),
            tuple(kinematics.upper_rad.tolist()),
            tuple(kinematics.velocity_limit_rad_s.tolist()),
        )
        self._model_sha256 = self.cell.model_sha256()
        self.ports = Ports(MujocoClock(self.cell), self._sensor, self._encoder, self._arm)

    @property
    def sensor_facts(self) -> SensorFacts:
        """Force sensor noise, as configured."""
        return self._facts

    @override
    def move(self, config: RunConfig, ready: ReadyPose) -> None:
        ticks = self.clock_ticks
        self.__exit__(None, None, None)
        self._build(config, ready)
        self.__enter__()
        self.set_clock_ticks(ticks)

    def prepare(self, trial: int) -> None:
        """Set the simulation to the initial state for this trial, and release the arm from its last stop."""
        self._arm.deactivate()
        self._sensor.deactivate()
        self.cell.reset(self.seed, trial)
        self._sensor.activate()
        self._arm.activate()

    def world(self) -> WorldRecord:
        """Return the data that a log needs to reproduce the trial that was just prepared."""
        truth = self.truth()
        facts = {
            "ticks": self.cell.ticks,
            "model_sha256": self._model_sha256,
            "hole_in_task_m": list(truth.hole_in_task_m),
        }
        facts |= {"drawn": dict(truth.drawn)} if truth.drawn else {}
        facts |= {"hole_turn_rad": list(truth.hole_turn_rad)} if any(truth.hole_turn_rad) else {}
        return WorldRecord(SIMULATOR, facts)

    @property
    def clock_ticks(self) -> int:
        """Number of control ticks on the simulator's clock."""
        return self.cell.ticks

    def set_clock_ticks(self, ticks: int) -> None:
        """Set the simulator's clock."""
        self.cell.set_ticks(ticks)

    def truth(self) -> GroundTruth:
        """Return the ground truth, which is only for scoring and baselines."""
        return self.cell.truth()

    def __enter__(self) -> Self:
        with ExitStack() as opened:
            for device in (self._sensor, self._encoder, self._arm):
                opened.enter_context(device)
            # All are open: from here on __exit__ closes them, in the reverse order.
            self._opened = opened.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._arm.stop()
        self._opened.close()
