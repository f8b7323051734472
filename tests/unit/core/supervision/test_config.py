"""Limits that are no limits are refused, and weaker ones have to be named."""

from dataclasses import replace
from math import inf, nan

import numpy as np
import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.motion import Kinematics, arm_named
from palpate.core.ports import SensorFacts
from palpate.core.supervision import SupervisionConfig, require_fitting, weakened_lines, weaker_settings
from palpate.core.supervision.config import DEFAULTS
from palpate.core.trial.config import TaskConfig
from tests.unit.core.fake_world import TOOL, ready_pose


def refused(field, value, **more):
    settings = {field: value, **more}
    with pytest.raises(ConfigurationError) as error:
        SupervisionConfig(**settings)
    assert "\n" not in str(error.value)
    return error.value


@pytest.mark.parametrize("value", [None, inf, nan])
def test_nothing_runs_without_a_force_limit(value):
    message = "a finite number of newtons: nothing runs without a force limit"
    assert str(refused("max_force_N", value)) == (f"supervision.max_force_N must be {message} (got {value!r})")


@pytest.mark.parametrize("name", DEFAULTS)
def test_a_weaker_limit_has_to_be_named(name):
    weaker = DEFAULTS[name] + 1
    error = refused(name, weaker)
    assert error.field == f"supervision.{name}"
    assert f"unless supervision.weakened names '{name}'" in error.accepted
    settings = {name: weaker, "weakened": (name,)}
    assert weaker_settings(settings) == SupervisionConfig(**settings).weakened == (name,)


@pytest.mark.parametrize(
    ("name", "weaker", "strength"),
    [
        ("on_trip", "hold", "retract"),
        ("retract_mm", 0.1, "at least 15 mm"),
        ("retract_speed_mm_s", 1, "at least 20 mm/s"),
    ],
)
def test_a_weaker_way_out_has_to_be_named_too(name, weaker, strength):
    assert refused(name, weaker).accepted == f"{strength}, unless supervision.weakened names {name!r}"
    settings = {name: weaker, "weakened": (name,)}
    (line,) = weakened_lines(SupervisionConfig(**settings))
    assert line == f"supervision.{name} is weakened: {weaker} instead of {strength.removeprefix('at least ')}"


@pytest.mark.parametrize("name", ["max_force_N", "on_trip", "retract_mm", "max_forceN", ""])
def test_nobody_names_limits_in_advance(name):
    error = refused("weakened", (name,))
    assert error.field == "supervision.weakened"
    assert error.accepted == "names of limits that are set weaker than their defaults: none is"


# Where arm, task and sensor are known.


ARM = arm_named("zebra-zero")
HOME, _ = ready_pose()


def fit(config, sensor=None, arm=ARM, home=HOME):
    kinematics = Kinematics(arm, TOOL)
    require_fitting(config, TaskConfig(), kinematics, np.array(home), sensor or SensorFacts(0.0, 0.0))


@pytest.mark.parametrize(
    ("config", "sensor", "field", "words"),
    [
        ({"max_force_N": 4.9}, {}, "max_force_N", "above 4.903, the pressing force, or every trial trips"),
        (
            {"max_force_N": 30.0},
            {"range_N": (200.0, 200.0, 30.0)},
            "max_force_N",
            "below 30, the sensor's range",
        ),
        ({}, {"noise_N": 0.4}, "unexpected_contact_N", "above 3.6, what noise alone shows, or every trial"),
        ({"max_force_rate_N_s": 120.0}, {"noise_N": 0.1}, "max_force_rate_N_s", "above 126, what noise"),
        ({}, {"range_N": (200.0, 200.0, 5.0)}, "max_force_N", "can never trip"),
        ({"max_force_N": 9.0}, {"range_N": (200.0, 200.0, 10.0)}, "max_force_rate_N_s", "below 2800"),
        ({"max_torque_Nm": 0.05}, {"noise_Nm": 0.01}, "max_torque_Nm", "above 0.09"),
        ({"max_command_jump_mrad": 7.0}, {}, "max_command_jump_mrad", "above 7.143, what the joints' velocity"),
    ],
)
def test_what_always_or_never_trips_is_refused(config, sensor, field, words):
    with pytest.raises(ConfigurationError) as error:
        fit(SupervisionConfig(**config), SensorFacts(**{"noise_N": 0.0, "noise_Nm": 0.0, **sensor}))
    assert error.value.field == f"supervision.{field}"
    assert words in error.value.accepted


def test_a_sensor_in_another_frame_is_refused():
    with pytest.raises(ConfigurationError, match=r"facts\.frame must be sensor: the task works"):
        fit(SupervisionConfig(), SensorFacts(0.1, 0.004, frame="base"))


def test_a_sensor_slower_than_the_limit_on_its_age_is_refused():
    fit(SupervisionConfig(), SensorFacts(0.1, 0.004, rate_Hz=25.0))
    with pytest.raises(ConfigurationError, match=r"rate_Hz must be above 20, or its samples are too old"):
        fit(SupervisionConfig(), SensorFacts(0.1, 0.004, rate_Hz=10.0))


def test_a_tolerance_below_the_encoder_is_refused():
    fit(SupervisionConfig(max_tracking_error_mrad=1.0))
    arm = replace(ARM, encoder_step_rad=(1e-3,) * 6)
    with pytest.raises(ConfigurationError, match=r"max_tracking_error_mrad must be above 10, ten encoder steps"):
        fit(SupervisionConfig(max_tracking_error_mrad=0.5), arm=arm)


def test_a_retraction_faster_than_the_joints_is_refused_with_the_speed_that_is_possible():
    with pytest.raises(ConfigurationError, match=r"retract_speed_mm_s must be .* where a joint of zebra") as error:
        fit(SupervisionConfig(retract_speed_mm_s=900.0))
    possible = float(error.value.accepted.split()[2])
    fit(SupervisionConfig(retract_speed_mm_s=possible * 0.98))
    fit(SupervisionConfig(retract_speed_mm_s=900.0, on_trip="hold", weakened=("on_trip",)))


def test_a_retraction_longer_than_the_arm_is_refused():
    home = (0.0, 0.6, -0.9, 0.0, 0.3, 0.0)
    arm = replace(ARM, posture_rad=home, lower_rad=(-3.14, 0.59, -0.91, -3.14, -3.14, -3.14))
    with pytest.raises(ConfigurationError, match=r"retract_mm must be .* the travel of zebra-zero above"):
        fit(SupervisionConfig(retract_mm=200.0), arm=arm, home=home)
