"""The model of an arm against the pose that its controller reports, and the tool against what is entered there."""

from dataclasses import replace
from math import hypot, pi

import numpy as np
import pytest

from palpate.adapters.config import RunConfig
from palpate.adapters.experiments import open_rig, ready_pose
from palpate.adapters.hardware import RigContext
from palpate.adapters.hardware import rig as hardware_rig
from palpate.adapters.hardware.kinematics_check import ReportedPose, disagreement, judge_kinematics, judge_tool
from palpate.adapters.hardware.ur import UrTable, make_ur_rtde
from palpate.core.errors import ConfigurationError
from palpate.core.job import ToolConfig
from palpate.core.motion import arm_named
from palpate.simulation.emulators.ur.kinematics import LENGTHS_M, tool_pose
from tests.unit.core.motion.test_arms import calibration
from tests.virtual_ur import HOME, VirtualUr

TOOL = ToolConfig()
# The default tool: sensor 30 mm, tip 140 mm beyond it, 0.35 kg at 77.1 mm; the sensor and its plate weigh 0.15 kg.
TCP = (0.0, 0.0, 0.17, 0.0, 0.0, 0.0)
CENTRE = (0.0, 0.0, (0.35 * 0.107142857 + 0.15 * 0.015) / 0.5)


def reported(arm="ur5e", q=HOME, **changes):
    given = {"tool_on_flange": TCP, "payload_kg": 0.5, "payload_centre_m": CENTRE, **changes}
    return ReportedPose(q, tool_pose(arm, q, given["tool_on_flange"]), **given)


def context(arm="ur5e", **changes):
    return replace(RigContext.of(arm, VirtualUr().clock), **changes)


@pytest.mark.parametrize("name", LENGTHS_M)
def test_every_arm_of_universal_robots_agrees_with_its_controller(name):
    rng = np.random.default_rng(2)
    for q in rng.uniform(-pi, pi, (20, 6)):
        mm, mrad = disagreement(arm_named(name), reported(name, tuple(q.tolist())))
        assert (mm, mrad) == pytest.approx((0.0, 0.0), abs=2e-3 if name.endswith("e") or name == "ur20" else 0.05)


@pytest.mark.parametrize(("model", "real"), [("ur10", "ur5"), ("ur5", "ur5e"), ("ur16e", "ur10e"), ("ur5e", "ur20")])
def test_model_of_another_arm_is_refused_even_where_a_nominal_one_is_accepted(model, real):
    with pytest.raises(
        ConfigurationError, match=r"the model of this arm, within .*; its flange is [0-9.]+ mm"
    ) as caught:
        judge_kinematics(context(model, accept_kinematics=True), reported(real))
    assert (caught.value.field, caught.value.value) == ("arm", model)


def moved(pose, mm):
    x, *rest = pose.tool_in_base
    return replace(pose, tool_in_base=(x + mm * 1e-3, *rest))


def test_nominal_model_is_accepted_by_a_person_up_to_ten_millimetres():
    with pytest.raises(ConfigurationError, match=r"--accept-kinematics: its nominal model is 9\.0 mm"):
        judge_kinematics(context(), moved(reported(), 9.0))
    accepted = context(accept_kinematics=True)
    assert judge_kinematics(accepted, moved(reported(), 9.0)).startswith("the nominal model of ur5e is 9.0 mm and")
    with pytest.raises(ConfigurationError, match="within 10 mm and 50 mrad"):
        judge_kinematics(accepted, moved(reported(), 11.0))
    with pytest.raises(ConfigurationError, match="is nan mm"):
        judge_kinematics(accepted, moved(reported(), float("nan")))


def test_calibrated_model_needs_nobody_and_is_refused_from_one_millimetre_on(tmp_path):
    arm = replace(arm_named("ur5e"), calibration=calibration(tmp_path / "own.yaml"))
    assert judge_kinematics(context(arm), moved(reported(), 0.9)).startswith("the calibrated model of ur5e is 0.9 mm")
    with pytest.raises(ConfigurationError, match="within 1 mm and 5 mrad"):
        judge_kinematics(context(arm), moved(reported(), 1.1))
    turned = reported(tool_on_flange=TCP)
    turn = np.array(turned.tool_in_base[3:])
    off = replace(turned, tool_in_base=(*turned.tool_in_base[:3], *(turn * (1.0 + 0.006 / hypot(*turn)))))
    with pytest.raises(ConfigurationError, match=r"and 6\.0 mrad"):
        judge_kinematics(context(arm), replace(off, tool_on_flange=(0.0,) * 6))


def test_tool_of_the_job_is_compared_with_what_is_entered_at_the_controller():
    message = "payload of the controller and tool agree, and so does its tool centre point"
    assert judge_tool(context(), TOOL, reported()) == message
    assert "it has no tool centre point" in judge_tool(context(), TOOL, reported(tool_on_flange=(0.0,) * 6))


@pytest.mark.parametrize(
    ("changes", "field", "accepted"),
    [
        ({"tool_on_flange": (0.0, 0.0, 0.15, 0.0, 0.0, 0.0)}, "tool.tip_mm", "the tip at (0, 0, 150) mm"),
        ({"payload_kg": 0.0}, "tool.mass_kg", "a mass that fits the payload of 0 kg"),
        ({"payload_kg": float("nan")}, "tool.mass_kg", "a mass that fits the payload of nan kg"),
        ({"payload_kg": 3.0}, "tool.mass_kg", "a mass that fits the payload of 3 kg"),
        ({"payload_centre_m": (0.05, 0.0, 0.08)}, "tool.centre_of_mass_mm", "the payload's centre at (50, 0, 80) mm"),
    ],
)  # fmt: skip
def test_another_tool_than_the_controller_has_is_refused(changes, field, accepted):
    with pytest.raises(ConfigurationError) as caught:
        judge_tool(context(), TOOL, reported(**changes))
    assert caught.value.field == field
    assert accepted in str(caught.value)


def test_arm_is_compared_before_it_gets_power():
    stated = {"payload_kg": 0.5, "payload_cog_m": CENTRE, "tcp_offset": TCP}
    link = VirtualUr(arm="ur5e", **stated)
    table = UrTable()
    for arm, accepted, message in (("ur5e", False, r"nominal model is 0\.0 mm"), ("ur10e", True, "its flange is")):
        its = context(arm, clock=link.clock, tool=TOOL, accept_kinematics=accepted)
        adapter = make_ur_rtde(table, its, lambda: link)
        with pytest.raises(ConfigurationError, match=message):
            adapter.open()
        assert not link.is_open
    adapter = make_ur_rtde(table, context("ur5e", clock=link.clock, tool=TOOL, accept_kinematics=True), lambda: link)
    first, second = adapter.open()
    adapter.close()
    assert "the nominal model of ur5e is 0.0 mm and 0.0 mrad from the flange that the controller reports" in first
    assert "payload of the controller and tool agree" in second


@pytest.mark.parametrize(
    ("emulated", "accept", "accepted"), [(False, False, False), (True, False, True), (False, True, True)]
)
def test_nominal_model_is_accepted_by_the_option_or_on_an_emulated_rig(
    tmp_path, monkeypatch, emulated, accept, accepted
):
    made = []

    def arm(_, context, *_more):
        made.append(context)
        raise ConfigurationError("arm", "", "no more")

    monkeypatch.setattr(hardware_rig, "arm_in_process", arm)
    monkeypatch.setattr(hardware_rig, "force_sensor_maker", lambda _: lambda *_: None)
    text = (
        f"[rig]\nemulated = {str(emulated).lower()}\n[arm]\nadapter = 'ur-rtde'\n[force_sensor]\nadapter = 'jr3-can'\n"
    )
    (tmp_path / "rig.toml").write_text(text)
    config = RunConfig(arm="ur5e")
    with pytest.raises(ConfigurationError, match="no more"):
        open_rig(config, ready_pose(config), str(tmp_path / "rig.toml"), accept_kinematics=accept)
    assert made[0].accept_kinematics is accepted
    assert made[0].tool == config.tool
