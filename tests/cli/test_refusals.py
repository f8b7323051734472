"""What commands refuse: exit code 2, and one line that names the setting or file and says what is accepted.

Ranges and types of all settings are tried in ``tests/unit/adapters/config/test_declared.py``, documents in
``test_documents.py``.
"""

import os
from pathlib import Path

import pytest

from palpate.adapters.cli.rig_new import rig_text
from palpate.core.automata.document import to_json_text
from palpate.core.automata.machine import Kind, Machine

ROOT = Path(__file__).parents[2]
SPATIAL = "--task insertion-6dof"
ON_A_RIG = f"--rig zebra.toml --job {ROOT / 'examples' / 'jobs' / 'paper-peg.toml'}"
LONG = "x" * 300
"""A name longer than any file system takes."""
COMMANDS = "train, run, compare, study, plan, show, explore, infer, replay, report, log, render, emulate, rig, settings"
STUDIES = {"reach": "[grid]\n'task.goal.x_mm' = [400.0, 1900.0]", "small": "[study]\ntrials = 1\n"}
STUDIES["slip"] = "[study]\npolicies = ['qlearning']\n"
TEXTS = {
    "zebra.toml": rig_text("zebra-nmc", "jr3-can", "zebra-zero"),
    "deep.json": "[" * 100_000,
    "deep.toml": f"a = {'[' * 2000}",
    "walks.txt": "AABBC\nABBC\nBBAC\n",
    "refused.py": "number = 3\n",
    "unwell.py": "1 / 0\n",
    "there.svg": "",
    "there.png": "",
    "full/file": "",
    "a_study/run.toml": "",
} | {f"{name}.toml": text for name, text in STUDIES.items()}


@pytest.fixture
def desk(palpate, trained, tmp_path):
    """The command line in a folder with all kinds of files."""
    for name, text in TEXTS.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    log = (trained / "logs" / "trial-00001.mcap").read_bytes()
    (tmp_path / "sound.mcap").write_bytes(log)
    (tmp_path / "torn.mcap").write_bytes(log[:500])
    (tmp_path / "even.json").write_text(to_json_text(Machine(Kind.DFA, ("a", "b"), ((1, 0), (0, 1)), (True, False))))
    (tmp_path / "all.json").write_text(to_json_text(Machine(Kind.DFA, ("a", "b"), ((0, 0),), (True,))))
    os.mkfifo(tmp_path / "a_pipe")
    return palpate


@pytest.mark.parametrize(
    ("words", "message"),
    [
        # Unknown words and names.
        ("frobnicate", COMMANDS),
        ("train --scenario dark", "scenario must be one of paper, blind"),
        ("run", "a policy file, or one of oracle"),
        ("run --policy a_study", "a policy file, such as a_study/policy.json"),
        ("run --policy torque --policy random", "--policy is given twice; give it once, followed by all its values"),
        ("run --policy torque --cell.peg.shape hexagon", "did you mean --part.shape?"),
        ("compare --seeds 3", "palpate study compares policies over several seeds"),
        ("train --learner mine:Mine", "palpate train --policy trains code of your own"),
        ("study slip.toml", "; did you mean q-learning?"),
        ("run --policy magic", "policy must be a policy file, or one of oracle"),
        ("replay sound.mcap --set task.max_force=5", "did you mean task.max_force_N"),
        # What does not go together.
        ("train --learner q-learning --learning.trace-decay 0.5", "sarsa or options, which learning.trace_decay"),
        ("train --learning.belief.restart_steps 5", "learner must be belief, which learning.belief"),
        ("train --learner hmm --learning.hmm.lattice 0", "a lattice to round them to"),
        ("run --policy torque --learning.alpha 0.5", "--learning.alpha changes nothing: palpate run does not learn"),
        ("train --policy sarsa", "--learner sarsa chooses it"),
        ("train --out x --perception.memory even.json", "symbols of the machine"),
        ("run --policy torque --jobs 2 --live", "1 with --rig, --live or --view"),
        (f"run {ON_A_RIG} --policy torque --cell.sensor.force-noise-N 0", "--cell.sensor sets up"),
        (f"train {ON_A_RIG} --cell.tilt-mrad=2", "with --rig, the rig file describes the rig"),
        (f"run {ON_A_RIG} --policy oracle", "which is unknown on a rig"),
        ("emulate --arm panda --wires zebra-nmc", "the bus is a Zebra Zero's"),
        ("emulate --arm ur5e --force jr3-can --event 3:sensor-silent", "such as 12s:protective-stop"),
        ("emulate --event 3s:protective-stop", "one of emergency-stop, cable-pulled, sensor-silent, sensor-cable"),
        ("replay sound.mcap --set cell.peg.friction=0.5", "a setting of the core"),
        ("replay sound.mcap --continue-in-mujoco", "a what-if"),
        ("infer walks.txt there.svg --out x", "either one text file"),
        ("infer --show even.json all.json", "1 automaton file (got 2)"),
        (f"run {SPATIAL} --policy corner-first", "3 or more for the policy corner-first"),
        (f"run {SPATIAL} --policy corner-first --task.options corners 4", "0, as the round peg of cell.peg."),
        (f"run {SPATIAL} --policy torque --task.options most_tilt_deg 30", "a turn about y that zebra-zero can make"),
        ("run --policy corner-first", "one of --task insertion-6dof"),
        ("run --policy torque --task.options way_mm 9", "no option of insertion"),
        # Values.
        ("train --out", "--out needs a value"),
        ("replay sound.mcap --jobs -1", "from 0 to 1024 (got -1)"),
        ("study reach.toml", "zebra-zero reaches"),
        # What is missing.
        ("log info", "name one or more"),
        ("plan", "palpate plan needs a further argument: Job file"),
        ("run --policy torque --trials 1.5", "--trials must be a whole number (got '1.5')"),
        ("run --policy torque extra", "palpate run takes no further argument extra"),
        ("log export sound.mcap --out x --to json", "to must be one of csv"),
        # Files that are read.
        ("compare --policy deep.json", "JSON (maximum recursion depth"),
        ("study deep.toml", "deep.toml"),
        ("run --policy torque --job gone.toml", "job = 'gone.toml': no such file; there are examples in examples/jobs"),
        ("run --policy gone/policy.json", "policy = 'gone/policy.json': no such file; accepted: a policy file, or one"),
        ("show full", "policy file = 'full': no file, but a folder"),
        ("study torn.mcap", "study file = 'torn.mcap': no text in UTF-8"),
        ("plan small.toml", "one of the tables part, tool"),
        ("log import gone --out x.mcap", "gone: is not there; name a folder that ros2 bag recorded"),
        ("log info \x1b[31m", "\\x1b[31m: is not there"),
        ("log info a_pipe", "a_pipe: is no file; name a log"),
        (f"log export {LONG} --to csv --out x", "is not there; name a log"),
        ("log export sound.mcap torn.mcap --to csv --out x/y", "torn.mcap: contains nothing readable"),
        # Files and folders that are written.
        (f"train --out {LONG}", "File name too long"),
        ("train --out a_study", "a_study: already holds a run (run.toml)"),
        ("run --policy torque --out a_study", "a_study: already holds a run (run.toml)"),
        ("compare --out a_study", "a_study: already holds a run (run.toml)"),
        ("study small.toml --out full", "full: holds something already, and no study"),
        ("explore --figure there.svg", "is never overwritten"),
        ("explore --figure out.jpg", "figure must be "),
        ("infer --show even.json --out even.jpg", ".dot"),
        ("log export sound.mcap --to csv --out full", "a new or an empty folder"),
        ("emulate --rig-file .", "exists"),
        # Adapters.
        ("rig check refused", "package.module:Name"),
        ("rig check unwell:Name", "ZeroDivisionError"),
        ("rig check tests.fake_devices:FakeArm", "package.module:Name"),
    ],
)
def test_refused_in_one_line(desk, words, message):
    desk.refuses(words, message)
