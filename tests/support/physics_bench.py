"""A bench for the simulated cell: the core's own motion and measurement over the ports, with no task on top.

Every figure is taken on the full six-joint arm, with the motion laws and gains of a trial. Only the noise and the bias
of the wrist sensor are off; the encoders keep their steps. Positions are in the task frame.
"""

from functools import cache
from math import atan2, cos, degrees, hypot, pi, remainder, sin, sqrt

import numpy as np

from palpate.adapters.config.run import RunConfig
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.control_loop import tick_time_ns
from palpate.core.motion.arm import arm_named
from palpate.core.motion.controllers import DampingControl, HybridControl, PositionControl
from palpate.core.motion.model import Kinematics
from palpate.core.motion.tip_motion import TipMotion
from palpate.core.perception import SignalProcessor
from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, Snapshot
from palpate.core.trial import N_PER_KGF, Measurement, find_ready_pose, goal_in_base
from palpate.simulation.work_cell.config import CellConfig, ComplianceConfig, PegConfig, SensorConfig
from tests.support.tool import TOOL

LEAST_OFFSET_M, MOST_OFFSET_M = 0.3e-3, 3e-3
_SILENT = SensorConfig(force_noise_N=0.0, torque_noise_Nm=0.0, force_bias_N=0.0, torque_bias_Nm=0.0)
_PASS_SPEED_M_S = 0.005
_DROP_M = 1e-3  # a peg that deep has found the hole
_STEP_M = 0.5e-3
_PUSH_M = 75e-6  # so far into the wall: the springs then push the peg against it with some 3 N


def quiet(arm="zebra-zero", *, peg=None, compliance=None, **settings):
    """A run whose wrist sensor has neither noise nor bias, and whose cell has these settings."""
    cell = CellConfig(peg or PegConfig(), compliance or ComplianceConfig(), _SILENT, **settings)
    return RunConfig(arm=arm, cell=cell)


def headings(count):
    """Headings spread round the circle by the golden angle: evenly, and never in step with facets of peg or hole."""
    return [k * pi * (3.0 - sqrt(5.0)) for k in range(count)]


def offsets_m(count):
    """Offsets spread over their range by the golden section, for the same reason: they fall in step as headings do."""
    share = (sqrt(5.0) - 1.0) / 2.0
    return [LEAST_OFFSET_M + (MOST_OFFSET_M - LEAST_OFFSET_M) * ((k + 0.5) * share % 1.0) for k in range(count)]


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@cache
def ready_pose(arm):
    """The ready pose over the default goal; the same for every cell."""
    return find_ready_pose(arm, RunConfig().tool.geometry, RunConfig().task)


class Bench:
    """One work cell and what it takes to press, slide and push in it. A context manager."""

    def __init__(self, config):
        arm, goal, ready = arm_named(config.arm), goal_in_base(config.task.goal), ready_pose(config.arm)
        control, travel = config.control, config.task.travel_speed_mm_s * 1e-3
        signal = SignalProcessor(CONTROL_RATE_HZ, config.perception.cutoff_Hz, config.perception.filter_order)
        axial_N_per_m = control.axial_stiffness_N_per_mm * 1e3
        self._goal, self.rig = goal, SimulatedRig(config, ready)
        self.measurement = Measurement(Kinematics(arm, TOOL), goal, signal, axial_N_per_m)
        self.press_N = config.task.press_kgf * N_PER_KGF
        self._motion = TipMotion(Kinematics(arm, TOOL), goal, ready.tip_rotation, PERIOD_S)
        along = DampingControl(control.damping_N_s_per_m, (0.0, 0.0, -self.press_N), travel, axial_N_per_m, PERIOD_S)
        self._free = PositionControl(control.position_gain_per_s, travel, PERIOD_S)
        self._press = HybridControl(self._free, along)
        self._slide = HybridControl(PositionControl(control.position_gain_per_s, _PASS_SPEED_M_S, PERIOD_S), along)
        self._step_ticks = config.task.ticks_per_action
        self._clearance_m = config.cell.peg.clearance_mm * 1e-3
        # Opposite a triangle's wall is a corner, twice as far away.
        self._back_m = self._clearance_m * (2.0 if config.cell.peg.cross_section == "triangle" else 1.0)
        self._start_ns = self._tick = 0

    def __enter__(self):
        self.rig.__enter__()
        return self

    def __exit__(self, kind, error, trace):
        self.rig.__exit__(kind, error, trace)

    # Moves.

    def hang_above(self, x_m, y_m):
        """Start anew: go above (x, y), come to rest, tare there. Returns the raw sample at rest."""
        self.rig.prepare(0)
        self._start_ns, self._tick = self.rig.ports.clock.now_ns(), 0
        self._motion.start(self.rig.ports.joint_encoder.read().position_rad)
        self.measurement.reset()
        sample = self._run(self._free, (x_m, y_m, -3e-3), 60)
        self.measurement.tare((*sample.force_N, *sample.torque_Nm))
        return sample

    def press(self, x_m, y_m, ticks=120):
        """Start anew and come down with the peg's axis at (x, y); the default presses until all is steady."""
        self.hang_above(x_m, y_m)
        self._run(self._press, (x_m, y_m, 0.0), ticks)

    def enter_hole(self, depth_m, ticks=100):
        """Start anew and go straight down into the hole, not as far as its floor; the default is for 8 mm at most."""
        self.hang_above(0.0, 0.0)
        self._run(self._free, (0.0, 0.0, depth_m), ticks)

    def press_into_hole(self, ticks):
        """Start anew and come down on the hole's axis with the pressing force, until the peg stops or time is up."""
        self.hang_above(0.0, 0.0)
        self._run(self._press, (0.0, 0.0, 0.0), ticks)

    def push_to(self, x_m, y_m, ticks=60):
        """Push sideways at the present depth; returns where the true tip then is."""
        self._run(self._free, (x_m, y_m, self._motion.reference_m[2]), ticks)
        return self.rig.truth().tip_in_task_m

    # Figures.

    def cue_error_deg(self, offset_m, heading, step_heading=None):
        """Angle between the direction in which the torque tells the hole to be, and the truth."""
        x, y = offset_m * cos(heading), offset_m * sin(heading)
        if step_heading is None:
            self.press(x, y)
        else:
            self.press(x - _STEP_M * cos(step_heading), y - _STEP_M * sin(step_heading))
            self._run(self._press, (x, y, 0.0), self._step_ticks)
        _, (tx, ty, _) = self.measurement.filtered_wrench_at_tip()
        return degrees(remainder(atan2(tx, -ty) - (heading + pi), 2 * pi))

    def cue_lever_m(self):
        """Distance of the centre of pressure from the tip's centre."""
        (_, _, fz), (tx, ty, _) = self.measurement.filtered_wrench_at_tip()
        return hypot(tx, ty) / -fz

    def penetration_m(self):
        """How far the deepest contact point of the peg is inside the plate."""
        return -min((float(contact.dist) for contact in self.rig.cell.data.contact), default=0.0)

    def ripple_N(self, ticks=100):
        """Standard deviation of the force along the tool axis while pressing goes on."""
        forces = []
        for _ in range(ticks):
            self._run(self._press, self._motion.reference_m, 1)
            forces.append(self.measurement.force_N[2])
        return float(np.std(forces))

    def play_m(self, heading):
        """The clearance, by the way that the peg has from wall to wall of its hole; a triangle's heading is 0."""
        c, s, there_m, back_m = cos(heading), sin(heading), self._clearance_m + _PUSH_M, self._back_m + _PUSH_M
        x1, y1, _ = self.push_to(there_m * c, there_m * s)
        x2, y2, _ = self.push_to(-back_m * c, -back_m * s)
        return (c * (x1 - x2) + s * (y1 - y2)) * self._clearance_m / (self._clearance_m + self._back_m)

    def capture_half_width_m(self, heading, resolution_m=1e-5):
        """The largest distance at which the peg's axis may pass the hole's at 5 mm/s and still drop in."""
        caught, missed = 0.0, self._clearance_m + 1e-3
        while missed - caught > resolution_m:
            miss = 0.5 * (caught + missed)
            if self._drops_when_passing(heading, miss):
                caught = miss
            else:
                missed = miss
        return 0.5 * (caught + missed)

    def _drops_when_passing(self, heading, miss_m, run_up_m=1.5e-3):
        c, s = cos(heading), sin(heading)
        self.press(-run_up_m * c - miss_m * s, -run_up_m * s + miss_m * c, 70)
        end = (run_up_m * c - miss_m * s, run_up_m * s + miss_m * c, 0.0)
        for _ in range(int(2 * run_up_m / _PASS_SPEED_M_S * CONTROL_RATE_HZ)):
            self._run(self._slide, end, 1)
            if self.rig.truth().depth_m > _DROP_M:
                return True
        return False

    def _run(self, controller, target_m, ticks):
        ports = self.rig.ports
        for _ in range(ticks):
            ports.clock.sleep_until(tick_time_ns(self._start_ns, self._tick))
            wrench, joints = ports.force_sensor.read(), ports.joint_encoder.read()
            self.measurement.update(Snapshot(self._tick, ports.clock.now_ns(), wrench, joints))
            velocity = controller.velocity_m_s(self._motion.reference_m, target_m, self.measurement.force_N)
            self._motion.adopt(ports.arm.send(self._motion.move(velocity)))
            self._tick += 1
        return wrench
