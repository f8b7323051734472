"""Text that begins with a byte-order mark, as editors on Windows write it, is read as the same text without it."""

import codecs
from pathlib import Path

import pytest

from palpate.adapters.config import learner_in, read_toml, write_into
from palpate.adapters.experiments import RunFolder
from palpate.adapters.experiments.grid import grid_named
from palpate.adapters.files import json_of_file, load_automaton, load_examples
from palpate.adapters.log import strings_from
from palpate.core.motion import ArmDescription
from palpate.core.motion.model import load_model
from tests.unit.core.motion.test_arms import urdf

AUTOMATON = (
    '{"schema": "palpate.automaton/2", "kind": "dfa", "alphabet": ["a"], "start": "even",'
    ' "states": [{"name": "even", "output": true, "next": {"a": "even"}}]}'
)
POLICY = '{"schema": "palpate.policy/3", "learner": {"kind": "sarsa"}}'
RIG = '[arm]\nadapter = "zebra-zero"\n'
TRIALS = (
    "trial,outcome,success,exploration_time_s,actions,peak_force_N,measured_peak_force_N,depth_mm,start_x_mm,"
    "start_y_mm,hole_x_mm,hole_y_mm,ticks,temperature,marked,trip\n"
    "0,inserted,True,1.0,3,2.0,2.0,0.5,0.0,0.0,,,90,,,\n"
)


def _written(path):
    write_into(path, {"calibration": {"gain": 2.0}})
    return path.read_text(encoding="utf-8")


def _joints(path):
    path.write_bytes(path.read_bytes() + Path(urdf(path.with_suffix(".plain"), 6)).read_bytes())
    return list(load_model(ArmDescription(str(path), "tool", (0.0,) * 6))[0].names)


@pytest.mark.parametrize(
    ("name", "text", "read"),
    [
        pytest.param("strings.txt", "AB\nBA\n", lambda path: strings_from([str(path)]), id="strings"),
        pytest.param("map.txt", ".A\nBA\n", lambda path: grid_named(str(path), 2), id="map"),
        pytest.param("rig.toml", RIG, read_toml, id="settings, studies, rigs"),
        pytest.param("rig.toml", RIG, _written, id="a rig with new values"),
        pytest.param("automaton.json", AUTOMATON, load_automaton, id="automaton"),
        pytest.param("policy.json", POLICY, json_of_file, id="policy, checkpoint"),
        pytest.param("policy.json", POLICY, lambda path: learner_in(str(path)), id="learner of a policy"),
        pytest.param(
            "summary.json", POLICY, lambda path: RunFolder(path.parent).summary(), id="figures of a reported run"
        ),
        pytest.param("examples.csv", "state,action\na,+x\n", load_examples, id="examples"),
        pytest.param("trials.csv", TRIALS, lambda path: RunFolder(path.parent).read_trials(), id="trials"),
        pytest.param("arm.urdf", "", _joints, id="URDF"),
    ],
)
def test_a_byte_order_mark_is_not_part_of_a_text(tmp_path, name, text, read):
    found = []
    for mark in (b"", codecs.BOM_UTF8):
        path = tmp_path / f"with {len(mark)}" / name
        path.parent.mkdir()
        path.write_bytes(mark + text.encode())
        found.append(read(path))
    assert found[0] == found[1]
