"""A terminal that is closed in the middle of a trial on an emulated arm."""

import os
import subprocess
import threading
from contextlib import suppress

import pytest

from palpate.adapters.config import EmulationConfig, scenario
from palpate.adapters.experiments import ready_pose
from palpate.adapters.hardware import EmulatedCell
from palpate.adapters.log import read_log
from palpate.simulation.emulators.nmc.servo import PicServo
from tests.command_line import JOB, PATIENCE_S, CommandLine, command, wait_until
from tests.wall_clock.test_rigs import PATIENT, logs, relax, require_in_time


@pytest.fixture
def stops(monkeypatch):
    """Every stop command that reaches an emulated motor adds an entry."""
    seen = []
    stop = PicServo.stop

    def noted(self, *words):
        seen.append(1)
        stop(self, *words)

    monkeypatch.setattr(PicServo, "stop", noted)
    return seen


@pytest.fixture
def rig(tmp_path, stops):
    """The rig file of an emulated arm and force sensor that live in this process."""
    config, ended = scenario("paper"), threading.Event()
    with EmulatedCell(config, ready_pose(config), EmulationConfig(), str(tmp_path / "counts.json")) as cell:
        life = threading.Thread(target=cell.run, args=(ended.is_set, lambda truth: None), daemon=True)
        life.start()
        path = tmp_path / "rig.toml"
        path.write_text(cell.rig_toml(JOB[1]))
        relax(path)
        yield path
        ended.set()
        life.join()


def test_a_closed_terminal_stops_the_arm_and_leaves_a_whole_log(tmp_path, rig, stops):
    out = tmp_path / "out"
    words = ("run", "--rig", rig, "--policy", "random", "--trials", 9, "--out", out, *PATIENT)
    master, slave = os.openpty()
    process = subprocess.Popen(
        command(*words), stdin=slave, stdout=slave, stderr=slave, text=True, preexec_fn=lambda: os.login_tty(slave)
    )
    os.close(slave)
    try:
        try:
            wait_until(lambda: bool(logs(out)) and logs(out)[-1].stat().st_size > 30_000, process)
        except AssertionError:
            require_in_time(_printed(master))
            raise
        before = len(stops)
        os.close(master)
        code = process.wait(PATIENCE_S)
    finally:
        process.kill()
        process.wait()
    end = read_log(logs(out)[-1]).end
    assert end is not None, f"the log has no end; exit code {code}"
    if end.outcome not in ("interrupted", "stopped from outside"):
        require_in_time(f"{end.outcome} {end.error} {end.stopped_by}")
    assert code in (1, 130)
    assert len(stops) > before
    assert "equal in every bit" in CommandLine().succeed("replay", *logs(out), "--jobs", 1)


def _printed(terminal_fd):
    """What the terminal still holds of an ended process."""
    os.set_blocking(terminal_fd, False)
    with suppress(OSError):
        return os.read(terminal_fd, 1 << 16).decode()
    return ""
