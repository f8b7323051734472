"""The examples run and name existing files; wrong calls end with one line."""

import re
import runpy
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import pytest

from palpate.adapters.config import scenario
from palpate.adapters.experiments import Run, load_policy
from palpate.adapters.mujoco import SimulatedRig
from palpate.simulation.work_cell import HiddenValues

EXAMPLES = Path(__file__).parents[2] / "examples"
ALL = ("train_and_look", "own_policy", "replay_gate", "infer_automaton", "system_identification")
QUICK = frozenset(ALL) - {"replay_gate", "system_identification"}
"""Those that have a shorter form; the others are short."""


class Example:
    """Runs examples, as ``python examples/NAME.py`` would, and reads what they print."""

    def __init__(self, monkeypatch, capfd):
        self._monkeypatch, self._capfd = monkeypatch, capfd

    def code(self, name, *words):
        """The exit code of a call."""
        path = EXAMPLES / f"{name}.py"
        with self._monkeypatch.context() as patched:
            patched.setattr(sys, "argv", [str(path), *map(str, words)])
            # Python puts a script's folder there.
            patched.setattr(sys, "path", [str(EXAMPLES), *sys.path])
            try:
                runpy.run_path(str(path), run_name="__main__")
            except SystemExit as end:
                # What sys.exit does with a text.
                return end.code if isinstance(end.code, int) else int(end.code is not None)
        return 0

    def printed(self, name, out):
        """What the quick form prints; it must go well, and end by telling where to look."""
        assert "--outt" in self.complaint(name, "--outt", out)
        assert not out.exists()
        code = self.code(name, *(["--quick"] if name in QUICK else []), "--out", out)
        printed, complaint = self._capfd.readouterr()
        assert code == 0, complaint
        last = printed.splitlines()[-1]
        assert last.startswith("look at ")
        found = [Path(place) for place in re.findall(rf"{re.escape(str(out))}[^\s,)]*", last)]
        assert found
        assert [str(place) for place in found if not place.exists()] == []
        return printed

    def complaint(self, name, *words):
        """The last line of what a refused call says."""
        assert self.code(name, *words) == 2
        printed, complaint = self._capfd.readouterr()
        assert printed == ""
        assert "Traceback" not in complaint
        return complaint.splitlines()[-1]


@pytest.fixture
def example(monkeypatch, capfd):
    return Example(monkeypatch, capfd)


def test_every_example_is_here():
    # A policy, which tests/cli/test_ask_a_person.py runs.
    assert {path.stem for path in EXAMPLES.glob("*.py")} == {*ALL, "ask_a_person"}


def test_train_and_look(example, tmp_path):
    out = tmp_path / "out"
    printed = example.printed("train_and_look", out)
    assert printed.count(" s of exploration, ") == 3
    assert "17 states, 8 actions; q-learning, trained on 3 trials" in printed
    assert load_policy(out / "policy.json").learner is not None
    assert len(list((out / "logs").glob("*.mcap"))) == 3
    # A second run may not overwrite the first.
    assert "already holds a run" in example.complaint("train_and_look", "--quick", "--out", out)


@pytest.mark.nightly
def test_own_policy(example, tmp_path):
    printed = example.printed("own_policy", tmp_path / "out")
    assert re.search(r"^torque: \d of 3 inserted, median \d+\.\d\d s$", printed, re.MULTILINE)
    (inserted,) = re.findall(r"^homing: (\d) of 3 inserted", printed, re.MULTILINE)
    assert int(inserted) >= 2


@pytest.mark.nightly
def test_replay_gate(example, tmp_path):
    printed = example.printed("replay_gate", tmp_path / "out")
    assert "2 of 2 equal in every bit" in printed
    assert "the core's code differs from the recording's" in printed
    assert re.findall(r"^exit code (\d)$", printed, re.MULTILINE) == ["0", "1"]


@pytest.mark.nightly
def test_infer_automaton(example, tmp_path):
    printed = example.printed("infer_automaton", tmp_path / "out")
    (letters,) = re.findall(r"^letters: 4 states, (\S+) steps", printed, re.MULTILINE)
    (automaton,) = re.findall(r"^automaton: \d+ states, (\S+) steps", printed, re.MULTILINE)
    assert float(automaton) < float(letters)


@pytest.mark.nightly
def test_system_identification(tmp_path, capsys, monkeypatch):
    """A cell with friction 0.35 for 0.2, springs of 0.7, a wrench 20 ms late and a plate that is 0.8 mm higher."""
    config = replace(scenario("paper"), seed=11)
    other = HiddenValues(springs_share=0.7, friction=0.35, latency_ms=20.0, plate_mm=0.8)
    Run(config, make_rig=lambda *parts: SimulatedRig(*parts, other)).evaluate(1, "torque", tmp_path)
    example = import_module("examples.system_identification")
    monkeypatch.setattr(example, "MOST_ITERATIONS", 30)
    monkeypatch.setattr(sys, "argv", ["example", str(tmp_path / "logs")])
    example.main()
    printed = capsys.readouterr().out
    found = {name: float(value) for name, value in re.findall(r"^(\w+) +([\d.]+) \+- [\d.]+$", printed, re.MULTILINE)}
    before_N, after_N = map(float, re.findall(r"([\d.]+) N rms", printed))
    assert after_N < 0.5 * before_N
    assert found["friction"] == pytest.approx(0.35, rel=0.2)
    assert found["axial_N_per_mm"] == pytest.approx(3.5, rel=0.15)
    assert found["across_N_per_mm"] == pytest.approx(28.0, rel=0.2)
    assert found["damping_ratio"] == pytest.approx(0.7, rel=0.2)
    assert found["delay_ms"] == pytest.approx(20.0, abs=3.0)
    assert found["plate_mm"] == pytest.approx(1.8, abs=0.15)


def test_system_identification_refuses_what_holds_no_contact(example, tmp_path):
    assert example.code("system_identification", tmp_path) == 2
