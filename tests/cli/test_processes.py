"""What only a process of its own can show: the installed script, start-up imports, a closed pipe, Ctrl-C."""

import json
import os
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.command_line import QUICK, TIMEOUT_S, finished_trials, results_in, wait_until

HEAVY = ("matplotlib", "pyarrow", "pinocchio", "mujoco", "scipy", "sklearn", "torch", "pandas")
SETTINGS = ("tyro", "pydantic")
MANY = 5000
"""Trials that no training ends with before a test that is held up has come to it."""


def test_the_installed_script_refuses(palpate):
    script = Path(sys.executable).with_name("palpate")
    done = subprocess.run([script, "show", "missing"], capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    assert (done.returncode, done.stdout, done.stderr) == palpate("show", "missing")


@pytest.mark.nightly
def test_libraries_of_drawing_that_are_absent_stop_nothing_else(palpate):
    script, names = Path(sys.executable).with_name("palpate"), {"MPLBACKEND": "module://absent", "MUJOCO_GL": "osmesa"}
    words = ["run", "--policy", "torque", "--trials", "1", *map(str, QUICK), "--out", "drawn"]
    subprocess.run([script, *words], env={**os.environ, **names}, capture_output=True, timeout=TIMEOUT_S, check=True)
    assert Path("drawn/trials.png").exists()


def test_help_and_info_import_nothing_heavy(trained):
    log = trained / "logs" / "trial-00000.mcap"
    program = (
        "import sys, json\n"
        "from palpate.adapters.cli.main import main\n"
        "def loaded(names): return [name for name in names if name in sys.modules]\n"
        "main(['--help'])\n"
        f"before = [loaded({SETTINGS + HEAVY!r})]\n"
        "main(['log', '--help'])\n"
        f"main(['log', 'info', {str(log)!r}])\n"
        f"sys.stderr.write(json.dumps([*before, loaded({HEAVY!r})]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=TIMEOUT_S, check=True
    )
    assert json.loads(done.stderr) == [[], []]


def test_a_reader_that_closes_the_pipe_gets_no_traceback(trained, start):
    process = start("show", trained / "policy.json")
    process.stdout.close()  # as `palpate show policy.json | head -1` may do
    with process.stderr as stderr:
        assert stderr.read() == ""
    assert process.wait(timeout=TIMEOUT_S) == 1


@pytest.mark.nightly
def test_ctrl_c_ends_training_in_order_and_the_message_says_how_to_go_on(palpate, tmp_path, trained, start):
    # The space, and a policy to begin from, are traps for the command that is printed.
    out = tmp_path / "a run"
    words = ("train", *QUICK, "--policy", trained / "policy.json")
    process = start(*words, "--trials", MANY, "--out", out)
    wait_until(lambda: finished_trials(out) >= 1, process)
    process.send_signal(signal.SIGINT)
    printed, complaint = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 130
    assert "Traceback" not in complaint
    done = finished_trials(out)
    assert f"ended after {done} of {MANY} trials" in printed
    assert (out / "trials.csv").read_text().endswith("\n")
    assert not list(out.glob(".*"))
    assert json.loads((out / "summary.json").read_text())["finished"] is False
    tables = {name: (out / name).read_bytes() for name in ("trials.csv", "decisions.csv")}

    name, *again = shlex.split(printed.split("resume with: ")[1])
    assert name == "palpate"
    again[again.index("--trials") + 1] = str(done + 1)
    palpate.succeed(*again)
    palpate.succeed(*words, "--trials", done + 1, "--out", "straight")
    straight = results_in(tmp_path / "straight")
    assert results_in(out) == straight
    assert all(straight[table].startswith(content) for table, content in tables.items())
