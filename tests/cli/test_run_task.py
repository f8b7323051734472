"""``palpate run --task``: other tasks than insertions, run, recorded and replayed; and what does not go together."""

import csv
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from palpate.adapters.config import task_kind
from tests.command_line import CommandLine

PACKAGE = Path(__file__).parents[2] / "examples" / "press_task"
SHORT = "--task surface-follow --task.options stroke_mm 10 way_mm 12"
SPATIAL = "--task insertion-6dof"
GIVING = f"{SPATIAL} --policy give-way --task.options"
SQUARE = f"{SPATIAL} --policy corner-first --task.options corners 4"


def test_a_surface_is_followed_recorded_and_replayed(palpate: CommandLine, tmp_path: Path) -> None:
    out = tmp_path / "run"
    told = palpate.succeed("run", *SHORT.split(), "--arm", "ur5", "--trials", 1, "--out", out)
    assert told.startswith("surface-follow, ur5, scenario paper")
    assert "success 100.0%" in told
    # All options are told, those too that nobody gave.
    assert '"speed_mm_s" = 20.0' in (out / "run.toml").read_text()
    assert "1 of 1 equal" in palpate.succeed("replay", out, "--jobs", 1)
    what_if = palpate("replay", out, "--jobs", 1, "--set", "task.press_kgf=0.3")
    assert (what_if.code, "1 would have gone otherwise" in what_if.stdout) == (1, True)
    assert "asks no policy" in palpate("replay", out, "--jobs", 1, "--policy", "torque").stdout


def test_who_knows_the_pose_of_hole_and_grip_goes_straight_in_and_is_replayed(palpate: CommandLine) -> None:
    words = ("--scenario", "blind-square", "--policy", "omniscient-pose", "--trials", 1, "--out", "run")
    assert "success 100.0%" in palpate.succeed("run", "--task", "insertion-6dof", *words)
    with Path("run/trials.csv").open(newline="") as stream:
        assert [float(row["exploration_time_s"]) < 1.0 for row in csv.DictReader(stream)] == [True]
    assert "1 of 1 equal" in palpate.succeed("replay", "run", "--jobs", 1)


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.syspath_prepend(str(PACKAGE))
    yield
    sys.modules.pop("press_task", None)
    task_kind.cache_clear()


def test_a_task_of_another_package_is_run_and_replayed(
    palpate: CommandLine, tmp_path: Path, installed: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "run"
    words = ("--task", "press_task:PRESS", "--task.options", "hold_s", "0.2", "--trials", 1)
    assert "'done': 1" in palpate.succeed("run", *words, "--out", out)
    assert "1 of 1 equal" in palpate.succeed("replay", out, "--jobs", 1)
    sys.modules.pop("press_task", None)
    task_kind.cache_clear()
    monkeypatch.setattr(sys, "path", [place for place in sys.path if place != str(PACKAGE)])
    without = palpate("replay", out, "--jobs", 1)
    assert (without.code, "No module named 'press_task'" in without.stdout) == (2, True)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("run --task surface-folow", "did you mean surface-follow?"),
        (f"run {SPATIAL} --policy corner-first", "3 or more for the policy corner-first"),
        ("run --policy give-way", "one of --task insertion-6dof"),
        (f"run {GIVING} level_beside_mm 36", "task.area_half_width_mm = 11.0 is refused: at least 39"),
        (f"run {GIVING} tool_kg 0", "task.options.unanswered_N = 28.0 is refused: 0 with tool_kg = 0"),
        (f"run {GIVING} most_lean_deg 30", "a turn about y that zebra-zero can make above the goal"),
        (f"run {SQUARE}", "0, as the round peg of cell.peg.cross_section has"),
        ("run --task=surface-follow --policy torque", "none beside --task surface-follow"),
        ("run --task surface-follow --task.options sped_mm_s 9", "did you mean speed_mm_s?"),
        ("run --task surface-follow --task.options speed_mm_s 190", "where a joint of zebra-zero is at its limit"),
        ("run --task surface-follow --task.goal.x-mm 330", "a place that zebra-zero reaches"),
        (f"run {SHORT} --cell.contacts listed", "searched, beside a contour"),
        ("run --policy none", "a policy file, or one of omniscient"),
        ("run --policy torque --task.options way_mm 9", "no option of insertion"),
        (f"train {SHORT}", "a task that lets a policy choose"),
        (f"compare {SHORT}", "asks no policy"),
        ("compare --policy corner-first", "one of --task insertion-6dof"),
        (f"prove {SQUARE} --trials 500", "0, as the round peg of cell.peg.cross_section has"),
        (f"faults {SHORT} --policy torque", "asks no policy"),
    ],
)
def test_what_does_not_go_together_is_one_line(palpate: CommandLine, words: str, told: str) -> None:
    palpate.refuses(words, told)
