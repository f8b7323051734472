"""The contact monitor: its budget, its patience, and wrenches that no contact can cause."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.core.ports import PERIOD_S, JointSample, Snapshot, WrenchSample
from palpate.core.tasks.contact import Monitor, TrialState
from palpate.core.trial import ControlConfig, TaskConfig, TrialSetup, TripReason
from tests.unit.core.fake_world import measurement, ready_pose

TASK, CONTROL = TaskConfig(), ControlConfig(moving_mass_kg=0.0, rigid_mass_kg=0.0)
NOISE = (0.1, 0.1, 0.1, 0.004, 0.004, 0.004)
STIFFNESS = 5e3


class Bench:
    """A monitor over a tool at one place, whose force is as given."""

    def __init__(self, task=TASK):
        self.state, self.x_m, self.z_m = TrialState(), 0.0, 1e-3
        self.reference_m = (0.0, 0.0, 0.0)
        self._measured, self._rng, self._tick = measurement(), np.random.default_rng(1), 0
        self.monitor = Monitor(self.state, task, CONTROL, 1e-6)
        setup = TrialSetup(0, 1, (0.0, 0.0))
        self.state.begin(setup)
        self.state.noise = NOISE
        self.monitor.begin(setup)

    def see(self, force_N, torque_Nm=(0.0, 0.0, 0.0)):
        """Take in a tick with this contact force, (3,), task frame, and torque about the tip."""
        self._tick += 1
        self.state.tick, time_ns = self._tick, round(self._tick * PERIOD_S * 1e9)
        q_rad, _ = ready_pose()
        wrench = WrenchSample((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), time_ns, time_ns, self._tick)
        snapshot = Snapshot(self._tick, time_ns, wrench, JointSample(q_rad, time_ns, time_ns, self._tick))
        self._measured.update(snapshot)
        noise = NOISE[0] * self._rng.standard_normal(3)
        x, y, z = (np.array(force_N) + noise).tolist()
        self._measured.force_N, self._measured.position_m = (x, y, z), (self.x_m, 0.0, self.z_m)
        self._measured.force_norm_N = float(np.hypot(np.hypot(x, y), z))
        self._measured.torque_across_at_tip_Nm = float(np.hypot(*torque_Nm[:2]))
        return self.monitor.check(snapshot, self._measured, self.reference_m, tared=True)

    def dither(self, ticks, scale=1.0):
        """Press and dither on a stiff plate for so long."""
        for _ in range(ticks):
            self.z_m += self.monitor.dither_m_s() * PERIOD_S if self._tick else 0.0
            self.see((0.0, 0.0, -scale * STIFFNESS * self.z_m))


def test_response_renews_the_budget():
    bench = Bench()
    bench.dither(60)
    assert bench.monitor.verified
    assert bench.monitor.spent_N == 0.0


def led(bench, velocity_m_s, ticks):
    """Let a law move the tool, and return how far from its start it came."""
    for _ in range(ticks):
        bench.see((0.0, 0.0, 0.0))
        x, y, z = zip(bench.reference_m, bench.monitor.bounded(velocity_m_s), strict=True)
        bench.reference_m = x[0] + x[1] * PERIOD_S, y[0] + y[1] * PERIOD_S, z[0] + z[1] * PERIOD_S
    return float(np.hypot(*bench.reference_m[:2]))


@pytest.mark.parametrize(("play_m", "most_N"), [(0.0, 42.0), (1e-2, 60.0)])
def test_without_a_response_no_motion_bends_the_gripper_by_more_than_twice_the_force_limit(play_m, most_N):
    bench = Bench()
    bench.monitor.presses(0.5 * 9.80665, play_m)
    stiffness_N_per_m = CONTROL.lateral_stiffness_N_per_mm * 1e3
    there_N = led(bench, (6e-3, 8e-3, 0.0), 140) * stiffness_N_per_m
    assert most_N - 3.0 < there_N < most_N
    back_N = led(bench, (-6e-3, -8e-3, 0.0), 280) * stiffness_N_per_m
    assert 57.0 < there_N + back_N < 60.0


def test_dither_bends_nothing_and_restores_nothing():
    bench = Bench()
    for _ in range(30):
        led(bench, (8e-3, 0.0, 0.0), 4)
        led(bench, (-8e-3, 0.0, 0.0), 4)
    assert 0.0 < bench.monitor.spent_N < bench.monitor.budget_N


@pytest.mark.parametrize(("force_N", "bend_N"), [(0.0, 0.0), (-8.0, 20.0)])
def test_there_is_no_play_beyond_the_first_contact_with_a_wall(force_N, bend_N):
    bench = Bench()
    bench.monitor.presses(5.0, play_m=1e-3)
    bench.see((0.0, 0.0, 0.0))
    bench.monitor.push((1.0, 0.0))
    for x_m in (0.0, 2e-4, 7e-4):
        bench.reference_m = (x_m, 0.0, 0.0)
        bench.see((force_N if x_m == 2e-4 else 0.0, 0.0, 0.0))
    assert bench.monitor.spent_N == pytest.approx(bend_N)


@pytest.mark.parametrize(("scale", "reason_ticks"), [(0.3, 40), (2.0, 40)])
def test_wrong_response_is_reported_within_a_window(scale, reason_ticks):
    bench = Bench()
    bench.dither(60, scale)
    assert bench.monitor.axial.contradicted
    for _ in range(reason_ticks):
        bench.dither(1, scale)
        bench.monitor.wait("to the dither", supported=True)
    trip = bench.state.constraints.mismatch
    assert trip.reason is TripReason.CONTACT_MISMATCH
    measured = float(trip.text.split("along the axis ")[1].split(" ")[0])
    assert measured == pytest.approx(scale * 5.0, rel=0.2)
    assert "expected 3.25 to 7.50 N/mm" in trip.text


def test_tool_that_slides_down_a_chamfer_contradicts_nothing():
    bench = Bench()
    for tick in range(60):
        bench.see((0.0, 0.0, -5.0))
        bench.x_m += 5e-5
        bench.z_m += 5e-5 + bench.monitor.dither_m_s() * PERIOD_S
        if tick > 20:
            bench.monitor.wait("to the dither", supported=True)
    assert bench.monitor.axial.contradicted
    assert bench.state.constraints.mismatch is None


def test_dead_sensor_is_reported_after_a_second_on_the_spot():
    bench = Bench()
    for tick in range(142):
        bench.see((0.0, 0.0, 0.0))
        bench.monitor.wait("to the dither")
        assert (bench.state.constraints.mismatch is not None) is (tick >= 140)
    trip = bench.state.constraints.mismatch
    assert trip.reason is TripReason.PLATE_NOT_FOUND


@pytest.mark.parametrize("share", [1.0, 0.0])
def test_wall_verifies_a_live_sensor_only(share):
    bench, x_m = Bench(), 1e-4
    bench.see((0.0, 0.0, 0.0))
    bench.monitor.push((1.0, 0.0))
    for _ in range(60):
        x_m += bench.monitor.push_dither_m_s() * PERIOD_S
        bench.x_m = x_m
        bench.see((-share * 4e4 * x_m, 0.0, 0.0))
    assert bench.monitor.verified is (share == 1.0)


@pytest.mark.parametrize(
    ("force_N", "friction", "trips"),
    [
        ((0.0, 0.0, 3.0), 0.6, True),
        ((0.0, 0.0, 2.0), 0.6, False),
        ((5.0, 0.0, 5.0), 0.6, False),
        ((5.0, 0.0, 6.0), 0.6, True),
        ((5.0, 0.0, 4.0), 0.0, True),
    ],
)
def test_pull_outside_the_friction_cone_is_implausible(force_N, friction, trips):
    bench = Bench(replace(TASK, friction=friction))
    found = [bench.see(force_N) for _ in range(8)]
    reasons = {trip.reason for trip in found if trip is not None}
    assert reasons == ({TripReason.PULLED} if trips else set())
    assert found[2] is None


@pytest.mark.parametrize(
    ("torque_Nm", "tilt_mrad", "trips"), [(0.5, 0.0, False), (0.7, 0.0, True), (1.5, 20.0, False), (1.8, 20.0, True)]
)
def test_torque_without_its_force_is_implausible_unless_the_hole_is_tilted(torque_Nm, tilt_mrad, trips):
    bench = Bench(replace(TASK, tilt_mrad=tilt_mrad))
    found = [bench.see((0.0, 0.0, -5.0), (torque_Nm, 0.0, 0.0)) for _ in range(8)]
    reasons = {trip.reason for trip in found if trip is not None}
    assert reasons == ({TripReason.TORQUE_WITHOUT_FORCE} if trips else set())
