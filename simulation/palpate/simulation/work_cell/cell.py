"""Simulated work cell with physics, sensor errors and the ground truth for scoring."""

import hashlib
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import chain
from math import copysign, remainder
from operator import sub
from struct import Struct
from typing import Final, TypeAlias

import mujoco
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from palpate.core.motion import Kinematics
from palpate.core.ports import GroundTruth, JointVector, axis_of
from palpate.core.trial import Purpose, generator
from palpate.simulation.work_cell.config import CellConfig
from palpate.simulation.work_cell.contact_pairs import NEAR_M, Leeway
from palpate.simulation.work_cell.contact_search import ContactSearch
from palpate.simulation.work_cell.contact_shapes import outermost_m, peg_rings
from palpate.simulation.work_cell.hidden import HiddenValues, SampleDelay
from palpate.simulation.work_cell.model import build_work_cell, quaternion
from palpate.simulation.work_cell.trial_world import trial_world

Array: TypeAlias = npt.NDArray[np.float64]

_NS: Final = 1_000_000_000
_NOISE_BLOCK: Final = 512
_SIX: Final = Struct("6d")
_PEAK_BLOCK: Final = 256
_RELIEF_TICKS: Final = 28
"""Time without load, 0.2 s, after which the sensor's zero returns; longer than a bounce, but before the next tare."""
_HISTORY_HEADER: Final = 2  # MuJoCo puts two words (period and cursor) before a sensor's sample times


class WorkCell:
    """A simulated work cell. Time advances in whole control ticks.

    Args:
        ready_rad: Joint angles at the start of every trial, (n,), with the tool pointing down.
        wander_m: Maximum distance of the peg from the nominal goal; it determines the plate size.
        hidden: The rig's hidden values, or None if there are none. The configuration already includes those that
            affect the physics.

    Attributes:
        model: MuJoCo's model, rebuilt for a trial with a different grip or clearance.
        contacts: The contact search, rebuilt with the model, or None if MuJoCo searches for all contacts at every step.
        ticks: Number of control ticks since construction; not reset between trials.
        time_ns: Exact time of the current tick, rounded down to nanoseconds.
        before_errors: Latest measured wrench without noise, bias or zero shift, negated, (6,).
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
        hidden: HiddenValues | None = None,
    ) -> None:
        self._hidden = hidden
        self._delay = SampleDelay(0.0 if hidden is None else hidden.latency_ms * 1e-3 * rate_Hz)
        kinematics.update(ready_rad)
        yaw_axis = kinematics.tip_in(goal_in_base).rotation[:, 0]
        self.config, self._yaw_rad = config, float(np.arctan2(yaw_axis[1], yaw_axis[0]))
        # Maximum distance of the peg from the true hole, with a margin for the springs.
        self._far_m = wander_m + config.hole_reach_mm * 1e-3 + 1e-3
        reach_m = config.plate_reach_m(wander_m)
        self._model_of = partial(
            build_work_cell,
            kinematics,
            goal_in_base=goal_in_base,
            tool_yaw_rad=self._yaw_rad,
            period_s=1.0 / rate_Hz,
            plate_reach_m=reach_m,
        )
        self.joints = kinematics.joints
        self.ticks = self.time_ns = 0
        self._rate_Hz = rate_Hz
        self._goal = goal_in_base.copy()
        self._ready: Array = ready_rad.copy()
        share = config.sensor.encoder_counts_share
        self._encoder_step = [step * share for step in kinematics.arm.encoder_step_rad] if share else None
        self._world = trial_world(config, 0, 0)
        self._build(self._world.cell)
        self._forces: list[bytes] = []
        self.reset(0, 0)

    def reset(self, seed: int, trial: int) -> None:
        """Put the arm in its ready pose; apply the hole position and sensor errors drawn for this seed and trial."""
        before, self._world = self._world, trial_world(self.config, seed, trial)
        if self._world.cell != before.cell:
            self._build(self._world.cell)
        self._zero_shift, self._zero_drift = np.array(self._world.zero_shift), np.array(self._world.zero_drift_per_s)
        self._zero_moves = bool(self._zero_shift.any() or self._zero_drift.any())
        self._delay.begin()
        self._begun, self._loaded = self.ticks, self.ticks - _RELIEF_TICKS
        self._axis = axis_of(self._world.hole_turn_rad)
        mujoco.mj_resetData(self.model, self.data)
        self.model.body_pos[self._plate] = self._goal.act(np.array(self._world.hole_in_task_m))
        if any(self._world.hole_turn_rad):
            turned = self._goal.rotation @ pin.exp3(np.array(self._world.hole_turn_rad))
            self.model.body_quat[self._plate] = quaternion(turned)
        self.place(self._ready)
        self._forces.clear()
        self._peak_square = 0.0
        # The tool is stationary: the sensor now measures only weight.
        self._weight: Array = self._wrench[:3].copy()
        self._noise = chain.from_iterable(self._noise_blocks(generator(seed, Purpose.SENSOR, trial)))

    def advance(self) -> None:
        """Advance the physics by one control tick with the current set-points."""
        if self.contacts is not None:
            self.contacts.step(self.config.substeps)
        else:
            mujoco.mj_step(self.model, self.data, self.config.substeps)
        self.ticks += 1
        self.time_ns = self.ticks * _NS // self._rate_Hz
        # Bytes, because numpy takes three times as long to copy a row into another array.
        self._forces.append(self._force_history.tobytes())
        if len(self._forces) == _PEAK_BLOCK:
            self._fold_peaks()
        if self._zero_moves and self.data.ncon:
            self._loaded = self.ticks

    @property
    def models(self) -> Sequence[mujoco.MjModel]:
        """Return the models that the physics may use."""
        return (self.model,) if self.contacts is None else self.contacts.models

    def place(self, position_rad: JointVector | Array) -> None:
        """Set the arm's joint angles, (n,) rad, and zero velocities."""
        self.data.qpos[: self.joints] = position_rad
        self.data.ctrl[:] = position_rad
        if self.contacts is not None:
            self.contacts.begin()
        else:
            mujoco.mj_forward(self.model, self.data)

    def set_ticks(self, ticks: int) -> None:
        """Set the clock, so that a trial can be repeated at its original time."""
        self.ticks = ticks
        self.time_ns = ticks * _NS // self._rate_Hz

    def command(self, position_rad: JointVector) -> None:
        """Set the servo set-points, (n,)."""
        self.data.ctrl[:] = position_rad

    def measure_wrench(self) -> list[float]:
        """Return the environment's wrench on the tool, (6,), in the sensor frame, including weight, bias and noise.

        MuJoCo reports the force from child to parent body, the negative of the environment's force on the tool.
        """
        true = self._wrench.tolist()
        if self._hidden is not None:
            measured = self._hidden.measured(
                self._delay.passed([-each for each in true]), -self.data.body("sensor").xmat[6:9]
            )
            true = [-each for each in measured]
        self.before_errors: list[float] = true
        wrench = list(map(sub, next(self._noise), true))
        return [a + b for a, b in zip(wrench, self._moved_zero(), strict=True)] if self._zero_moves else wrench

    def measure_joints(self) -> JointVector:
        """Return the joint angles from the encoders, (n,) rad."""
        if self._encoder_step is None:
            return self.joint_angles()
        q_rad = self._qpos.tolist()
        whole = tuple(map(sub, q_rad, map(remainder, q_rad, self._encoder_step)))
        # Whole counts. An angle of less than half a count becomes zero but keeps its sign.
        return whole if all(whole) else tuple(map(copysign, whole, q_rad))

    def joint_angles(self) -> JointVector:
        """Return the exact joint angles, (n,) rad, for the servos, which do not use the host's encoders."""
        return tuple(self._qpos.tolist())

    def model_sha256(self) -> str:
        """Return a digest of the compiled model, including the plate position."""
        buffer = np.empty(mujoco.mj_sizeModel(self.model), np.uint8)
        mujoco.mj_saveModel(self.model, None, buffer)
        return hashlib.sha256(buffer.tobytes()).hexdigest()

    def pose(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Copy this cell's pose to another model and its data for rendering."""
        data.qpos[:] = self.data.qpos
        model.body_pos[self._plate] = self.model.body_pos[self._plate]
        model.body_quat[self._plate] = self.model.body_quat[self._plate]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_camlight(model, data)

    def truth(self) -> GroundTruth:
        """Return the ground truth for the trial so far."""
        self._fold_peaks()
        tip = self._goal.actInv(self.data.site("tip").xpos.copy())
        hole = self._world.hole_in_task_m
        depth = float(np.dot(self._axis, tip - np.array(hole)))
        return GroundTruth(
            hole,
            (float(tip[0]), float(tip[1]), float(tip[2])),
            max(depth, 0.0),
            float(self._peak_square**0.5),
            self._world.drawn,
            self._world.hole_turn_rad,
        )

    def _build(self, cell: CellConfig) -> None:
        """Build the model for a cell with a different grip or clearance, which takes a few milliseconds."""
        self.model = self._model_of(cell)
        self.data = mujoco.MjData(self.model)
        self.contacts: ContactSearch | None = None
        if cell.contacts == "listed":
            leeways = (
                []
                if cell.peg.is_hull
                else [Leeway.of(cell, aside_m) for aside_m in sorted({NEAR_M, max(NEAR_M, self._far_m)})]
            )
            listed = [(leeway, self._model_of(cell, listed=leeway)) for leeway in leeways]
            radius_m = outermost_m(peg_rings(cell.peg)[0])
            self.contacts = ContactSearch(self.model, listed, self.data, radius_m, self._yaw_rad)
        self._plate = self.model.body("plate").id
        start = int(self.model.sensor_historyadr[0]) + _HISTORY_HEADER + cell.substeps
        # Views of MuJoCo's memory, which does not move.
        self._wrench: Array = self.data.sensordata[:6]
        self._qpos: Array = self.data.qpos[: self.joints]
        self._force_history: Array = self.data.history[start : start + 3 * cell.substeps]

    def _moved_zero(self) -> list[float]:
        """Return the shift in the zero since the beginning of the trial, (6,); strain gauges creep under load."""
        loaded = self.ticks - self._loaded < _RELIEF_TICKS
        drift = self._zero_drift * ((self.ticks - self._begun) / self._rate_Hz)
        moved: list[float] = (drift + self._zero_shift if loaded else drift).tolist()
        return moved

    def _fold_peaks(self) -> None:
        if self._forces:
            forces = np.frombuffer(b"".join(self._forces)).reshape(-1, 3) - self._weight
            self._peak_square = max(self._peak_square, float(np.einsum("ij,ij->i", forces, forces).max()))
            self._forces.clear()

    def _noise_blocks(self, rng: np.random.Generator) -> Iterator[Iterator[tuple[float, ...]]]:
        """Yield bias and white noise in blocks: single draws are slow, and whole lists burden the collector."""
        sensor = self.config.sensor
        bias = rng.standard_normal(6) * ([sensor.force_bias_N] * 3 + [sensor.torque_bias_Nm] * 3)
        spread = np.array([sensor.force_noise_N] * 3 + [sensor.torque_noise_Nm] * 3)
        while True:
            yield _SIX.iter_unpack(rng.standard_normal((_NOISE_BLOCK, 6)) * spread + bias)
