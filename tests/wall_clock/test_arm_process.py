"""The arm's process for real, with a stranger's arm in it: the loop killed, and the process itself."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.stopped_arm import wait_for

ARM = """
import os, time
from pathlib import Path
from palpate.adapters.hardware import ArmAdapter
from tests.fake_devices import FakeArm, FakeJointEncoder

class Noted(FakeArm):
    def stop(self):
        note(f"stop {os.getpid()}")
        super().stop()

    def close(self):
        super().close()
        note("close")

def note(text):
    with Path(os.environ["NOTES"]).open("a") as notes:
        notes.write(f"{text}\\n")

def make(settings, context):
    arm = Noted(context.clock, (0.0,) * 6, lower_rad=(-1.0,) * 6, upper_rad=(1.0,) * 6, max_step_rad=0.1)
    return ArmAdapter(FakeJointEncoder(context.clock, arm.position_rad), arm)
"""
LOOP = """
import sys
from palpate.adapters.config import RealTimeConfig
from palpate.adapters.hardware import MonotonicClock, RigContext
from palpate.adapters.hardware.arm_client import arm_in_process
from palpate.core.errors import PalpateError
from palpate.core.ports import JointCommand

clock = MonotonicClock()
context = RigContext.of("zebra-zero", clock)
arm = arm_in_process("strange", {}, context, clock, real_time=RealTimeConfig(), timeout_ns=10**9)
with arm:
    print("moving", flush=True)
    try:
        while True:
            arm.send(JointCommand((0.05,) * 6))
            clock.sleep_until(clock.now_ns() + 7 * 10**6)
    except PalpateError as error:
        print(f"{clock.now_ns()} {error}", flush=True)
"""


@pytest.mark.parametrize("victim", ["loop", "arm"])
def test_whichever_is_killed_nothing_is_left_and_the_other_one_knows(
    victim: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    described = tmp_path / "strange-1.0.dist-info"
    described.mkdir()
    (described / "METADATA").write_text("Metadata-Version: 2.1\nName: strange\nVersion: 1.0\n")
    (described / "entry_points.txt").write_text("[palpate.adapters]\narm.strange = strange_arm:make\n")
    (tmp_path / "strange_arm.py").write_text(ARM)
    notes = tmp_path / "notes"
    monkeypatch.setenv("NOTES", str(notes))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *filter(None, sys.path)]))
    loop = subprocess.Popen([sys.executable, "-c", LOOP], stdout=subprocess.PIPE, text=True)
    assert loop.stdout is not None
    try:
        assert loop.stdout.readline() == "moving\n"
        children = Path(f"/proc/{loop.pid}/task/{loop.pid}/children")
        (arm,) = (Path("/proc") / number for number in children.read_text().split())
        if victim == "loop":
            loop.kill()
            wait_for(lambda: not arm.exists())
            assert notes.read_text() == f"stop {arm.name}\nclose\n"
        else:
            os.kill(int(arm.name), signal.SIGKILL)
            told = loop.stdout.readline()
            assert "fake arm: stopped by a fault (the arm's process was killed by SIGKILL; what stops" in told
            assert loop.wait(10) == 0
    finally:
        loop.kill()
        loop.communicate()
