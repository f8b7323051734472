"""The running work cell: physics, sensor errors, and the truth, for scoring only."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from typing import Final, TypeAlias

import mujoco
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from palpate.core.insertion import Purpose, draw_in_disc, generator
from palpate.core.motion import Kinematics
from palpate.core.ports import JointVector, Truth
from palpate.simulation.work_cell.config import CellConfig
from palpate.simulation.work_cell.model import PLATE_REACH_M, build_work_cell

Array: TypeAlias = npt.NDArray[np.float64]

_NS: Final = 1_000_000_000
_NOISE_BLOCK: Final = 512
_PEAK_BLOCK: Final = 4096
_HISTORY_HEADER: Final = 2  # MuJoCo puts two words (period and cursor) before a sensor's sample times


class WorkCell:
    """One simulated work cell. Time goes on by whole control ticks, exactly.

    Args:
        kinematics: The arm with its tool; read at construction only.
        config: Physical parameters.
        goal_in_base: Placement of the nominal goal.
        ready_rad: Joint angles that every trial starts from, (n,), tool pointing down.
        rate_Hz: Control rate.
        wander_m: How far from the nominal goal the peg may be led; the plate is made large enough for it.

    Attributes:
        ticks: Control ticks since construction; resets do not turn time back.
        time_ns: The time of that tick, exact and rounded down to whole nanoseconds.
    """

    def __init__(
        self,
        kinematics: Kinematics,
        config: CellConfig,
        *,
        goal_in_base: pin.SE3,
        ready_rad: Array,
        rate_Hz: int,
        wander_m: float = 0.0,
    ) -> None:
        kinematics.update(ready_rad)
        yaw_axis = kinematics.tip_in(goal_in_base).rotation[:, 0]
        self.config = config
        self.model = build_work_cell(
            kinematics,
            config,
            goal_in_base=goal_in_base,
            tool_yaw_rad=float(np.arctan2(yaw_axis[1], yaw_axis[0])),
            period_s=1.0 / rate_Hz,
            plate_reach_m=max(PLATE_REACH_M, wander_m + config.hole_uncertainty_mm * 1e-3 + 1e-3),
        )
        self.data = mujoco.MjData(self.model)
        self.joints = kinematics.joints
        self.ticks = self.time_ns = 0
        self._rate_Hz = rate_Hz
        self._goal = goal_in_base.copy()
        self._ready: Array = ready_rad.copy()
        self._plate = self.model.body("plate").id
        share = config.sensor.encoder_counts_share
        self._encoder_step: Array | None = np.array(kinematics.arm.encoder_step_rad) * share if share else None
        start = int(self.model.sensor_historyadr[0]) + _HISTORY_HEADER + config.substeps
        # Views into MuJoCo's memory, which stays where it is.
        self._wrench: Array = self.data.sensordata[:6]
        self._ctrl: Array = self.data.ctrl
        self._qpos: Array = self.data.qpos[: self.joints]
        self._force_history: Array = self.data.history[start : start + 3 * config.substeps]
        self._peak_rows: Array = np.empty((_PEAK_BLOCK, 3 * config.substeps))
        self.reset(0, 0)

    def reset(self, seed: int, trial: int) -> None:
        """Put the arm at its ready pose over a hole and with sensor errors that belong to (seed, trial)."""
        config = self.config
        rng = generator(seed, Purpose.HOLE, trial)
        x, y = draw_in_disc(rng, config.hole_uncertainty_mm * 1e-3, "disc")
        self._hole = (x, y, -config.hole_height_error_mm * 1e-3)
        mujoco.mj_resetData(self.model, self.data)
        self.model.body_pos[self._plate] = self._goal.act(np.array(self._hole))
        self.data.qpos[: self.joints] = self._ready
        self.data.ctrl[:] = self._ready
        mujoco.mj_forward(self.model, self.data)
        self._peak_count, self._peak_square = 0, 0.0
        # The tool hangs at rest: what the sensor carries now is weight.
        self._weight: Array = self._wrench[:3].copy()
        self._noise = self._noise_samples(generator(seed, Purpose.SENSOR, trial))

    def advance(self) -> None:
        """One control tick of physics under the present set-points."""
        mujoco.mj_step(self.model, self.data, nstep=self.config.substeps)
        self.ticks += 1
        self.time_ns = self.ticks * _NS // self._rate_Hz
        if self._peak_count == _PEAK_BLOCK:
            self._fold_peaks()
        self._peak_rows[self._peak_count] = self._force_history
        self._peak_count += 1

    def place(self, position_rad: JointVector) -> None:
        """Put the arm elsewhere than at its ready pose, (n,) rad, at rest."""
        self.data.qpos[: self.joints] = position_rad
        self.data.ctrl[:] = position_rad
        mujoco.mj_forward(self.model, self.data)

    def set_ticks(self, ticks: int) -> None:
        """Set the clock, so that a trial can be run again at the time at which it once ran."""
        self.ticks = ticks
        self.time_ns = ticks * _NS // self._rate_Hz

    def command(self, position_rad: JointVector) -> None:
        """New servo set-points, (n,)."""
        self._ctrl[:] = position_rad

    def measure_wrench(self) -> list[float]:
        """Wrench of the world on the tool (force, torque), (6,), sensor frame: weight, bias and noise included.

        MuJoCo reports the force from child to parent body; the world's force on the tool is its negative.
        """
        wrench: list[float] = (next(self._noise) - self._wrench).tolist()
        return wrench

    def measure_joints(self) -> JointVector:
        """Joint angles as the encoders count them, (n,) rad."""
        if self._encoder_step is None:
            return self.joint_angles()
        return tuple((np.rint(self._qpos / self._encoder_step) * self._encoder_step).tolist())

    def joint_angles(self) -> JointVector:
        """Exact joint angles, (n,) rad: for the servos, which do not depend on the host's encoders."""
        return tuple(self._qpos.tolist())

    def model_sha256(self) -> str:
        """Digest of the compiled model as it stands, the plate's place included."""
        buffer = np.empty(mujoco.mj_sizeModel(self.model), np.uint8)
        mujoco.mj_saveModel(self.model, None, buffer)
        return hashlib.sha256(buffer.tobytes()).hexdigest()

    def truth(self) -> Truth:
        """The true state of the trial so far."""
        self._fold_peaks()
        tip = self._goal.actInv(self.data.site("tip").xpos.copy())
        depth = float(tip[2]) - self._hole[2]
        return Truth(
            self._hole,
            (float(tip[0]), float(tip[1]), float(tip[2])),
            max(depth, 0.0),
            float(self._peak_square**0.5),
        )

    def _fold_peaks(self) -> None:
        if self._peak_count:
            forces = self._peak_rows[: self._peak_count].reshape(-1, 3) - self._weight
            self._peak_square = max(self._peak_square, float(np.einsum("ij,ij->i", forces, forces).max()))
            self._peak_count = 0

    def _noise_samples(self, rng: np.random.Generator) -> Iterator[Array]:
        """Bias and white noise, drawn in blocks because single draws cost more than the samples' use."""
        sensor = self.config.sensor
        bias = rng.standard_normal(6) * ([sensor.force_bias_N] * 3 + [sensor.torque_bias_Nm] * 3)
        spread = np.array([sensor.force_noise_N] * 3 + [sensor.torque_noise_Nm] * 3)
        while True:
            yield from rng.standard_normal((_NOISE_BLOCK, 6)) * spread + bias
