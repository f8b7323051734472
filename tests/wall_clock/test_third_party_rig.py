"""A third-party arm and force sensor over TCP, from a rig file: doctor, a trial, an agent."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from palpate.adapters.gymnasium_envs.peg_insertion import PegInsertionEnv
from palpate.core.errors import DeviceError
from palpate.core.ports import Life
from tests.command_line import wait_until
from tests.wall_clock.late import TooLateError, late_if
from tests.wall_clock.test_rigs import PATIENT

LATE = "stale|silent|no set-point for|age|gap|late|changed at"
"""What an error says that came about because something came late."""
PACKAGE = Path(__file__).parents[2] / "examples" / "third_party_rig"


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """The package with its entry points, as pip leaves it: nothing that lies beside it comes along."""
    project = tomllib.loads((PACKAGE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    info = tmp_path / "site" / "third_party_rig-1.0.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    rows = (f"{name} = {place}\n" for name, place in project["entry-points"]["palpate.adapters"].items())
    (info / "entry_points.txt").write_text("[palpate.adapters]\n" + "".join(rows))
    shutil.copytree(PACKAGE / "third_party_rig", info.parent / "third_party_rig")
    # As rig files of ours allow for a busy computer.
    device = info.parent / "third_party_rig" / "device.py"
    device.write_text(re.sub(r"(MAX_AGE_NS|DEAD_NS) = (\d+)", r"\1 = 10 * \2", device.read_text()))
    monkeypatch.syspath_prepend(str(info.parent))
    return info.parent


@pytest.fixture
def rig(tmp_path, installed):
    """The rig file of devices that are served; the arm by its place, the sensor by its entry point."""
    path = tmp_path / "rig.toml"
    words = [sys.executable, "-W", "error", "-m", "third_party_rig.fake", "--rig-file", str(path)]
    paths = {**os.environ, "PYTHONPATH": str(installed)}
    process = subprocess.Popen(words, env=paths, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        wait_until(lambda: path.exists() and "[force_sensor]" in path.read_text(), process)
        text = path.read_text().replace('"bench-arm"', '"third_party_rig.arm:make_arm"')
        path.write_text(f"{text}\n[watchdog]\nsetpoint_timeout_ms = 1000.0\n")
        yield path
    finally:
        process.kill()
        process.communicate()


@pytest.mark.nightly
def test_doctor_a_trial_and_an_agent(palpate, rig):
    with late_if(LATE, DeviceError):
        done = palpate("rig", "doctor", "--rig", rig, "--seconds", "0.3")
        assert "which gives angles only when it is switched on: add --move" in done.stdout
        assert "reads, 0 saturated" in done.stdout
        words = ("--confirm", "bench by the window", "--policy", "torque", "--trials", 1, "--out", "run")
        done = palpate("run", "--rig", rig, *words, *PATIENT[:-1])
        if done.code and re.search(LATE, done.stderr.splitlines()[-1]):
            raise TooLateError(done.stderr)
        assert done.code == 0, done.stderr
        assert "outcomes: 1 inserted" in done.stdout
        env = PegInsertionEnv(rig=str(rig), out="agent", config="run/run.toml")
        try:
            env.reset(seed=4)
            for action in (0, 4):
                env.step(action)
        finally:
            env.close()
    assert env.rig.ports.arm.life is Life.CLOSED
    # A trial that is left in its middle is recorded up to there.
    assert "stopped from outside" in Path("agent/trials.csv").read_text(encoding="utf-8")
    assert "2 of 2 equal in every bit" in palpate.succeed("replay", "run", "agent", "--jobs", 1)
