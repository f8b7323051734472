"""A rig file: what it says of its arm, and what a commissioning writes into it."""

import pytest

from palpate.adapters.config import CalibrationTable, RigFile, compose, remeasured, write_into
from palpate.core.errors import ConfigurationError, OutputError
from palpate.core.job import ToolConfig

RIG = """# the bench by the window
[rig]
name = "bench"   # as on its label

[force_sensor]
adapter = "jr3-can"
[force_sensor.facts]
range_N = [100.0, 100.0, 200.0]  # of the data sheet

[arm]
adapter = "cia402"
bitrate = 500000
"""
URDF = 'urdf = "arms/bench.urdf"\nflange = "tool"\nposture_rad = [0, 1, 0, 1, 0, 1, 0]\n'


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(RIG)
    return path


def test_arm_of_a_urdf_is_parted_from_the_settings_of_its_adapter(path):
    path.write_text(RIG + URDF)
    rig = RigFile.load(path)
    assert rig.arm.settings == {"bitrate": 500000}
    assert (rig.model.name, rig.model.urdf) == ("bench", str(path.parent / "arms/bench.urdf"))
    assert len(rig.model.encoder_step_rad) == 7


def test_arm_is_named_in_the_file_or_by_the_caller_and_not_by_both(path):
    with pytest.raises(ConfigurationError, match=r"in the rig file \[arm\] name = "):
        RigFile.load(path).arm_model()
    assert RigFile.load(path).arm_model("ur5e") == "ur5e"
    path.write_text(RIG + 'name = "ur5e"\n')
    assert RigFile.load(path).model == RigFile.load(path).arm_model("ur5e") == "ur5e"
    with pytest.raises(ConfigurationError, match="arm must be ur5e, which the rig file has"):
        RigFile.load(path).arm_model("ur10e")
    path.write_text(RIG + 'name = "ur5e"\ncalibration = "own.yaml"\n')
    calibrated = RigFile.load(path).model
    assert (calibrated.name, calibrated.calibration) == ("ur5e", str(path.parent / "own.yaml"))


@pytest.mark.parametrize(
    ("text", "refused"),
    [
        ("format = 1\n" + RIG, "format must be 2, which this version reads"),
        (RIG + URDF.replace("flange", "flansch"), "flange is missing"),
    ],
)
def test_rig_file_that_is_wrong_is_refused(path, text, refused):
    path.write_text(text)
    with pytest.raises(ConfigurationError, match=refused):
        RigFile.load(path)


def test_results_are_put_in_and_nothing_is_lost(path):
    write_into(path, "calibration", {"plate_mm": 21.5, "mounting_deg": 3.0})
    write_into(path, "calibration", {"plate_mm": 21.25, "hole_mm": (401.0, -1.5)})
    assert [line for line in RIG.splitlines() if line not in path.read_text().splitlines()] == []
    rig = RigFile.load(path)
    assert (rig.calibration.mounting_deg, rig.emulated) == (3.0, False)
    assert rig.calibration.run_settings(ToolConfig()) == {"place": {"x_mm": 401.0, "y_mm": -1.5, "z_mm": 21.25}}
    assert [each.name for each in path.parent.iterdir()] == ["rig.toml"]


@pytest.mark.parametrize("text", ['arm = {adapter = "a"}\nforce_sensor = {adapter = "f"}\n',
                                  'arm.adapter = "a"\nforce_sensor.adapter = "f"\n'])  # fmt: skip
def test_tables_may_be_inline_and_the_file_a_link(tmp_path, text):
    (tmp_path / "bench.toml").write_text(text)
    path = tmp_path / "rig.toml"
    path.symlink_to("bench.toml")
    write_into(path, "calibration", {"plate_mm": 21.5})
    assert path.is_symlink()
    assert RigFile.load(tmp_path / "bench.toml").calibration.plate_mm == 21.5


@pytest.mark.parametrize("text", ["[arm\n", "calibration = 3\n", None])
def test_file_that_was_spoiled_meanwhile_stays_as_it_is(path, text):
    path.unlink()
    if text is not None:
        path.write_text(text)
    with pytest.raises(OutputError, match=r"rig\.toml: takes no values: it was changed meanwhile .*do the step again"):
        write_into(path, "calibration", {"plate_mm": 21.5})
    assert (path.read_text() if path.exists() else None) == text


def test_step_continues_with_what_the_previous_one_has_found():
    stated = {"task": {"contact_kgf": 0.123}}
    config = compose("job", "q-learning", stated, job={"part": {}, "tool": {}})
    found = CalibrationTable(weight_N=9.81, plate_mm=21.5, axial_stiffness_N_per_mm=30.0)
    other = remeasured(config, found.run_settings(config.tool), None)
    assert (other.tool.mass_kg, other.tool.rigid_mass_kg) == (1.0, 0.7)
    assert (other.task.goal.z_mm, other.control.axial_stiffness_N_per_mm) == (21.5, 30.0)
    assert other.control.damping_N_s_per_m > config.control.damping_N_s_per_m
    assert other.task.contact_kgf == 0.123
    tool = {"mass_kg": 1.0, "rigid_mass_kg": 0.7, "axial_N_per_mm": 30.0}
    assert other == compose("job", "q-learning", stated, job={"part": {}, "tool": tool, "place": {"z_mm": 21.5}})
