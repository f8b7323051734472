"""``palpate rig calibrate``: what it refuses, and that it moves nothing unasked."""

import io
import sys
from pathlib import Path

import pytest

from tests.command_line import JOB

RIG = '[rig]\nname = "bench"\n[arm]\nname = "zebra-zero"\nadapter = "zebra-nmc"\n[force_sensor]\nadapter = "jr3-can"\n'


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        ((), "a rig file: palpate rig calibrate --rig FILE"),
        (("--rig", "rig.toml", *JOB, "--yes"), "--yes is for emulated rigs only: on bench a person confirms each step"),
        (
            ("--rig", "rig.toml", *JOB, "--steps", "plate", "dance"),
            "steps must be some of payload, plate, hole",
        ),
        (("--rig", "rig.toml", *JOB, "--steps", "hole"), "calibration.mounting_deg must be "),
        (("--rig", "rig.toml", *JOB, "--cell.peg.friction", "0.3"), "the rig file describes the rig"),
    ],
)
def test_refusals(palpate, words, problem):
    Path("rig.toml").write_text(RIG)
    assert problem in palpate.refusal("rig", "calibrate", *words)
    assert Path("rig.toml").read_text() == RIG


def test_a_rig_file_that_is_to_be_read_only_is_left_alone(palpate, monkeypatch):
    Path("rig.toml").write_text(RIG)
    monkeypatch.setattr("os.access", lambda path, mode: Path(path).is_dir())
    assert "rig.toml: cannot be written; make file and folder writable" in palpate.refusal(
        "rig", "calibrate", "--rig", "rig.toml", *JOB
    )


def test_who_confirms_no_step_opens_no_device(palpate, monkeypatch):
    Path("rig.toml").write_text(RIG)
    # Left out twice, then neither confirmed nor ended, then ended.
    monkeypatch.setattr("sys.stdin", io.StringIO("s\ns\nno\nn\nq\n"))
    done = palpate("rig", "calibrate", "--rig", "rig.toml", *JOB)
    assert done.code == 130
    assert done.stderr.count("Press Enter to start, s to skip") == 5
    assert Path("rig.toml").read_text() == RIG


def test_where_input_is_closed_nobody_answers(palpate, monkeypatch):
    Path("rig.toml").write_text(RIG)
    monkeypatch.setattr("sys.stdin", None)
    done = palpate("rig", "calibrate", "--rig", "rig.toml", *JOB)
    assert (done.code, "Press Enter to start" in done.stderr) == (130, True)
    sys.stdin.close()


def test_a_run_on_a_rig_takes_the_goal_that_was_measured(palpate):
    Path("rig.toml").write_text(RIG + "[calibration]\nplate_mm = 1500.0\n")
    # Out of the arm's reach: so it was taken, unless a person says something else.
    words = ("run", "--rig", "rig.toml", *JOB, "--policy", "torque")
    assert "must be a place that zebra-zero reaches" in palpate.refusal(*words)
    assert (
        palpate(*words, "--place.z-mm", "20", "--confirm", "bench").stderr.splitlines()[-1].startswith("palpate: JR3")
    )
