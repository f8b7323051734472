"""Measurement: from raw samples to the task frame, without weight, without bias, and with torque about the tip."""

from dataclasses import replace
from math import sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.core.errors import DeviceError
from palpate.core.motion import Kinematics, arm_named
from palpate.core.perception import SignalProcessor
from palpate.core.ports import CONTROL_RATE_HZ, JointSample, Snapshot, WrenchSample
from palpate.core.trial import GoalConfig, Measurement, goal_in_base
from tests.support.tool import TOOL
from tests.unit.core.fake_world import ready_pose

ARM = arm_named("zebra-zero")
GOAL = goal_in_base(GoalConfig())
TIP_IN_SENSOR = np.array([0.0, 0.0, 0.14])
NONE = (0.0, 0.0, 0.0)
# Tool down, and tilted by a few degrees about every axis: nothing is aligned by luck.
ANGLES = (0.3, 1.17, -1.42, 0.1, 0.5, 0.7)
BIAS = (0.7, -0.4, 6.0, 0.05, -0.02, 0.01)
forces = st.tuples(*[st.floats(-20.0, 20.0)] * 3)


def build(scale=(1.0,) * 6):
    signal = SignalProcessor(CONTROL_RATE_HZ, 4.0, 2, scale)
    return Measurement(Kinematics(ARM, TOOL), GOAL, signal, 5e3)


def sensor_to_task():
    kinematics = Kinematics(ARM, TOOL)
    kinematics.update(ANGLES)
    return GOAL.rotation.T @ kinematics.tip_rotation


def snapshot(force_at_tip=NONE, torque_at_tip=NONE, bias=BIAS):
    """What the sensor reports when the world acts like this on the tip, task frame."""
    to_sensor = sensor_to_task().T
    force = to_sensor @ force_at_tip
    torque = to_sensor @ torque_at_tip + np.cross(TIP_IN_SENSOR, force)
    fx, fy, fz, tx, ty, tz = np.concatenate((force, torque)) + np.array(bias)
    wrench = WrenchSample((float(fx), float(fy), float(fz)), (float(tx), float(ty), float(tz)), 0, 0, 0)
    return Snapshot(0, 0, wrench, JointSample(ANGLES, 0, 0, 0))


def settle(measurement, seen, ticks=400):
    for _ in range(ticks):
        measurement.update(seen)


@settings(deadline=None)
@given(forces)
def test_force_is_in_the_task_frame_and_without_lag(force):
    measurement = build()
    measurement.tare(BIAS)
    measurement.update(snapshot())
    measurement.update(snapshot(force))  # a step: the unfiltered force shows it in the very tick
    assert measurement.force_N == pytest.approx(force, abs=1e-12)


@settings(deadline=None)
@given(forces, st.tuples(*[st.floats(-0.1, 0.1)] * 3))
def test_torque_about_the_tip_comes_through_whatever_the_force(force, torque):
    measurement = build()
    measurement.tare(BIAS)
    settle(measurement, snapshot(force, torque))
    assert measurement.filtered_wrench_at_tip()[1] == pytest.approx(torque, abs=1e-8)


def test_sample_of_another_arm_is_refused():
    sample = snapshot()
    with pytest.raises(DeviceError, match="joint encoder: gives 5 joint angles, the arm has 6"):
        build().update(sample._replace(joints=replace(sample.joints, position_rad=ANGLES[:5])))


@pytest.mark.parametrize("late_ticks", [0, 1, 2, 5, 6])
def test_depth_is_that_of_the_place_at_the_time_of_a_force_that_is_late(late_ticks):
    """Place and force of different times made a tool that heaves seem to sink: 17 false drops in a trial."""
    kinematics, signal = Kinematics(ARM, TOOL), SignalProcessor(CONTROL_RATE_HZ, 4.0)
    measurement = Measurement(kinematics, GOAL, signal, 1e12)
    step_ns, depths = 1_000_000_000 // CONTROL_RATE_HZ, list[float]()
    for tick in range(12):
        seen = snapshot()
        angles = (0.3, 1.17 + 1e-3 * tick, *ANGLES[2:])
        # A force between two ticks, from the second late one on.
        late_ns = late_ticks * step_ns + (step_ns // 2 if late_ticks > 1 else 0)
        wrench = replace(seen.wrench, source_time_ns=tick * step_ns - late_ns)
        measurement.update(seen._replace(wrench=wrench, joints=JointSample(angles, tick * step_ns, 0, tick)))
        depths.append(measurement.position_m[2])
    then = depths[-1]
    if late_ticks > 1:
        then = 0.5 * (depths[-1 - late_ticks] + depths[-2 - late_ticks])
    assert measurement.tip_depth_m == pytest.approx(then, abs=1e-9)


@pytest.mark.parametrize("age_ticks", [0, 1, 3, 6])
def test_depth_of_a_tool_that_dithers_on_a_plate_is_the_plate_s_where_encoders_come_late(age_ticks):
    kinematics, signal = Kinematics(ARM, TOOL), SignalProcessor(CONTROL_RATE_HZ, 4.0)
    measurement = Measurement(kinematics, GOAL, signal, 5e3)
    step_ns, depths, places = 1_000_000_000 // CONTROL_RATE_HZ, list[float](), list[float]()
    for tick in range(40):
        angles = [(0.3, 1.17 + 3e-4 * sin(0.6 * then), *ANGLES[2:]) for then in (tick, tick - age_ticks)]
        kinematics.update(angles[0])
        place_m = GOAL.actInv(kinematics.tip_in_base).translation[2]
        seen = snapshot((0.0, 0.0, -5e3 * place_m))
        joints = JointSample(angles[1], (tick - age_ticks) * step_ns, 0, tick)
        wrench = replace(seen.wrench, source_time_ns=tick * step_ns)
        measurement.update(seen._replace(wrench=wrench, joints=joints))
        depths.append(measurement.tip_depth_m)
        places.append(place_m)
    assert max(places) - min(places) > 1e-4
    assert max(depths[10:]) - min(depths[10:]) < 0.02 * (max(places) - min(places))


def test_weight_in_a_tilted_tool_is_subtracted():
    weight_N, above_tip_m = 3.4, 0.06

    def hanging(q):
        kinematics = Kinematics(ARM, TOOL)
        kinematics.update(q)
        force = kinematics.tip_rotation.T @ (0.0, 0.0, -weight_N)
        torque = np.cross((0.0, 0.0, 0.14 - above_tip_m), force)
        fx, fy, fz, tx, ty, tz = np.concatenate((force, torque)) + np.array(BIAS)
        wrench = WrenchSample((float(fx), float(fy), float(fz)), (float(tx), float(ty), float(tz)), 0, 0, 0)
        return Snapshot(0, 0, wrench, JointSample(q, 0, 0, 0))

    upright, _ = ready_pose()
    leaning = (*upright[:3], upright[3] + 0.05, upright[4] + 0.1, upright[5] + 0.1)
    measurement = build()
    measurement.take_off_weight(weight_N, above_tip_m)
    measurement.update(hanging(upright))
    raw = hanging(upright).wrench
    measurement.tare((*raw.force_N, *raw.torque_Nm))
    assert measurement.turned_rad[0] < 1e-6
    settle(measurement, hanging(leaning))
    assert measurement.turned_rad[0] > 0.1
    filtered, live = measurement.filtered_wrench_at_tip(), measurement.live_torque_at_tip_Nm()
    for force_or_torque in (*filtered, live, measurement.force_N):
        np.testing.assert_allclose(force_or_torque, NONE, atol=1e-6)
