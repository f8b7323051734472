"""Results of a commissioning in a rig file."""

from pathlib import Path

import pytest

from palpate.adapters.config import CalibrationTable, RigFile, compose, remeasured, write_into
from palpate.core.errors import ConfigurationError, OutputError
from palpate.core.job import ToolConfig

RIG = """# the bench by the window
[rig]
name = "bench"   # as on its label

[arm]
adapter = "cia402"
nodes = [1, 2, 3]

[force_sensor]
adapter = "jr3-can"
[force_sensor.facts]
range_N = [100.0, 100.0, 200.0]  # of the data sheet
"""


def test_results_are_put_in_and_nothing_is_lost(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(RIG)
    write_into(path, {"force_sensor.facts": {"noise_N": 0.08}, "calibration": {"plate_mm": 21.5, "mounting_deg": 3.0}})
    write_into(path, {"calibration": {"plate_mm": 21.25, "hole_mm": (401.0, -1.5)}})
    kept = [line for line in RIG.splitlines() if line not in path.read_text().splitlines()]
    assert kept == []
    rig = RigFile.load(path)
    assert (rig.facts.noise_N, rig.facts.range_N) == (0.08, (100.0, 100.0, 200.0))
    assert (rig.calibration.mounting_deg, rig.emulated) == (3.0, False)
    assert rig.calibration.run_settings(ToolConfig()) == {"place": {"x_mm": 401.0, "y_mm": -1.5, "z_mm": 21.25}}
    assert [each.name for each in tmp_path.iterdir()] == ["rig.toml"]


@pytest.mark.parametrize(
    "text",
    ['arm = {adapter = "a"}\nforce_sensor = {adapter = "f"}\n', 'arm.adapter = "a"\nforce_sensor.adapter = "f"\n'],
)
def test_tables_may_stand_in_one_line_and_the_file_be_a_link(tmp_path: Path, text: str) -> None:
    (tmp_path / "bench.toml").write_text(text)
    path = tmp_path / "rig.toml"
    path.symlink_to("bench.toml")
    write_into(path, {"force_sensor.facts": {"noise_N": 0.08}, "calibration": {"plate_mm": 21.5}})
    assert path.is_symlink()
    rig = RigFile.load(tmp_path / "bench.toml")
    assert (rig.facts.noise_N, rig.calibration.plate_mm) == (0.08, 21.5)


@pytest.mark.parametrize("text", ["[arm\n", "calibration = 3\n", None])
def test_a_file_that_was_spoiled_meanwhile_stays_as_it_is(tmp_path: Path, text: str | None) -> None:
    path = tmp_path / "rig.toml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(OutputError, match=r"rig\.toml: takes no values: it was changed meanwhile .*do the step again"):
        write_into(path, {"calibration": {"plate_mm": 21.5}})
    assert (path.read_text() if path.exists() else None) == text


def test_a_table_that_says_what_no_calibration_finds_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(RIG + "[calibration]\nmounting_deg = 400.0\n")
    with pytest.raises(ConfigurationError, match=r"calibration\.mounting_deg = 400.0 is refused"):
        RigFile.load(path)


def test_a_step_goes_on_with_what_the_one_before_has_found() -> None:
    config = compose("job", "q-learning", {"task": {"contact_kgf": 0.123}}, job={"part": {}, "tool": {}})
    found = CalibrationTable(weight_N=9.81, plate_mm=21.5, axial_stiffness_N_per_mm=30.0)
    other = remeasured(config, found.run_settings(config.tool), None)
    assert (other.tool.mass_kg, other.tool.rigid_mass_kg) == (1.0, 0.7)
    assert (other.task.goal.z_mm, other.control.axial_stiffness_N_per_mm) == (21.5, 30.0)
    assert other.control.damping_N_s_per_m > config.control.damping_N_s_per_m
    assert other.task.contact_kgf == 0.123
    assert other == compose(
        "job", "q-learning", {"task": {"contact_kgf": 0.123}},
        job={"part": {}, "tool": {"mass_kg": 1.0, "rigid_mass_kg": 0.7, "axial_N_per_mm": 30.0},
             "place": {"z_mm": 21.5}},
    )  # fmt: skip
