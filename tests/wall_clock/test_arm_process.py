"""The arm's process for real, with a stranger's arm in it: the loop or the process itself stopped, killed, hanging."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.wall_clock.late import TooLateError, wait_for

ARM = """
import ctypes, os, signal, time
from pathlib import Path
from palpate.adapters.hardware import ArmAdapter
from tests.fake_devices import FakeArm, FakeJointEncoder

class Noted(FakeArm):
    sent_ns = 0

    def send(self, command):
        self.sent_ns = time.monotonic_ns()
        return super().send(command)

    def stop(self):
        note(f"stop {(time.monotonic_ns() - self.sent_ns) // 1000000}")
        super().stop()

    def close(self):
        super().close()
        note("close")

def note(text):
    with Path(os.environ["NOTES"]).open("a") as notes:
        notes.write(f"{text}\\n")

def make(settings, context):
    signal.signal(signal.SIGUSR2, lambda *_: ctypes.PyDLL(None).usleep(5_000_000))
    arm = Noted(context.clock, (0.0,) * 6, lower_rad=(-1.0,) * 6, upper_rad=(1.0,) * 6, max_step_rad=0.1)
    return ArmAdapter(FakeJointEncoder(context.clock, arm.position_rad), arm)
"""
LOOP = """
import ctypes, signal
from palpate.adapters.config import DeviceEntry, RealTimeConfig
from palpate.adapters.hardware import MonotonicClock, RigContext
from palpate.adapters.hardware.arm_client import arm_in_process
from palpate.core.errors import PalpateError
from palpate.core.ports import JointCommand

clock = MonotonicClock()
context = RigContext.of("zebra-zero", clock)
arm = arm_in_process(DeviceEntry("strange", {}), context, RealTimeConfig(), 3 * 10**8)
signal.signal(signal.SIGUSR2, lambda *_: ctypes.PyDLL(None).usleep(1_000_000))
with arm:
    for tick in range(10**9):
        try:
            arm.send(JointCommand((0.05,) * 6))
        except PalpateError as error:
            print(error, flush=True)
            break
        if tick == 20:
            print("moving", flush=True)
        clock.sleep_until(clock.now_ns() + 7 * 10**6)
"""
TIMEOUT_MS, ALLOWED_MS = 300, 50
"""Long enough for a loop on a busy computer."""


class Bench(NamedTuple):
    loop: subprocess.Popen[str]
    arm: Path
    notes: Path

    def said(self):
        return self.loop.stdout.readline()


@pytest.fixture
def bench(tmp_path, monkeypatch):
    described = tmp_path / "strange-1.0.dist-info"
    described.mkdir()
    (described / "METADATA").write_text("Metadata-Version: 2.1\nName: strange\nVersion: 1.0\n")
    (described / "entry_points.txt").write_text("[palpate.adapters]\narm.strange = strange_arm:make\n")
    (tmp_path / "strange_arm.py").write_text(ARM)
    monkeypatch.setenv("NOTES", str(tmp_path / "notes"))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *filter(None, sys.path)]))
    loop = subprocess.Popen([sys.executable, "-c", LOOP], stdout=subprocess.PIPE, text=True)
    try:
        assert loop.stdout.readline() == "moving\n"
        children = Path(f"/proc/{loop.pid}/task/{loop.pid}/children")
        (arm,) = (Path("/proc") / number for number in children.read_text().split())
        yield Bench(loop, arm, tmp_path / "notes")
    finally:
        loop.kill()
        loop.communicate()


def stopped_after_ms(bench):
    """Between the last set-point and the stop of the arm."""
    # The file is there before its line is.
    wait_for(lambda: bench.notes.exists() and bench.notes.read_text().endswith("\n"))
    return int(bench.notes.read_text().split()[1])


def test_loop_that_hangs_in_c_has_its_arm_stopped_in_time(bench):
    bench.loop.send_signal(signal.SIGUSR2)
    after_ms = stopped_after_ms(bench)
    if after_ms > TIMEOUT_MS + ALLOWED_MS:
        raise TooLateError(f"{after_ms} ms")
    # The arm got the last set-point a little after it was sent.
    assert after_ms > TIMEOUT_MS - ALLOWED_MS
    assert "fake arm: stopped by a fault (set-point time-out: no set-point for 3" in bench.said()
    assert bench.loop.wait(10) == 0
    wait_for(lambda: not bench.arm.exists())


def test_loop_that_is_killed_leaves_the_arm_at_rest_and_nobody_behind(bench):
    bench.loop.kill()
    after_ms = stopped_after_ms(bench)
    if after_ms > ALLOWED_MS:
        raise TooLateError(f"{after_ms} ms")
    bench.loop.wait()
    wait_for(lambda: not bench.arm.exists())
    assert bench.notes.read_text().split()[2:] == ["close"]


@pytest.mark.parametrize(
    ("way", "message"),
    [(signal.SIGKILL, "was killed by SIGKILL; only the drives"), (signal.SIGUSR2, "has not run for")],
    ids=["killed", "hanging in C"],
)
def test_loop_whose_arm_s_process_fails_knows_and_ends_it(way, message, bench):
    os.kill(int(bench.arm.name), way)
    assert f"fake arm: stopped by a fault (the arm's process {message}" in bench.said()
    assert bench.loop.wait(10) == 0
    wait_for(lambda: not bench.arm.exists())
    # Nothing of it moved the arm once the loop had given it up.
    assert not bench.notes.exists()
