"""A process that watches the loop, and acts when it dies."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from palpate.adapters.hardware.watchdogs import OperatorSources, OperatorStop, ProcessWatchdog, WatchdogTrip
from palpate.adapters.hardware.watchdogs.process_main import ACKNOWLEDGED, FED, QUIT, RESTING, Watch, stop_function
from palpate.core.errors import ConfigurationError, LifecycleError
from palpate.core.ports.contracts import FakeClock
from tests.unit.adapters.hardware.watchdogs.bench import active_arm, nothing_left_behind, wait_for

LONG_S = 600.0


def served(words: bytes, timeout_s: float = LONG_S, *, end: bool = True) -> list[bool]:
    """What a watch does about words that are all there already, and then the end of its input."""
    read_fd, write_fd = os.pipe()
    os.write(write_fd, words)
    acted: list[bool] = []

    def act(alive: bool) -> None:
        acted.append(alive)
        if not end:
            os.write(write_fd, QUIT)

    if end:
        os.close(write_fd)
    Watch(timeout_s, act).serve(read_fd)
    os.close(read_fd)
    if not end:
        os.close(write_fd)
    return acted


def test_whoever_says_farewell_is_not_missed() -> None:
    assert served(FED + QUIT) == []


def test_whoever_vanishes_is() -> None:
    assert served(FED) == [False]
    assert served(FED + RESTING) == [False]


def test_whoever_falls_silent_is() -> None:
    assert served(FED, 0.01, end=False) == [True]
    assert served(FED + ACKNOWLEDGED + FED, 0.01, end=False) == [True]


def test_a_function_is_found_by_name() -> None:
    assert stop_function("") is None
    assert stop_function("os:getpid") is os.getpid


def test_a_loop_that_is_fed_goes_on() -> None:
    arm = active_arm(FakeClock())
    with nothing_left_behind(), ProcessWatchdog(arm, FakeClock(), LONG_S, signal_number=0) as watchdog:
        for _ in range(100):
            watchdog.feed()
        watchdog.rest()
        assert watchdog.tripped is None
    assert arm.stops == []


def test_a_loop_that_dies_is_stopped_by_signal_and_latches() -> None:
    clock, told = FakeClock(), list[WatchdogTrip]()
    arm = active_arm(clock)
    operator = OperatorStop(arm, clock, OperatorSources(keys=False))
    with operator, ProcessWatchdog(arm, clock, 0.02, tell=told.append) as watchdog:
        watchdog.feed()
        wait_for(lambda: operator.tripped)
        wait_for(lambda: watchdog.tripped)
        assert arm.stops
        watchdog.feed()
        assert told == [watchdog.tripped]
        assert told[0].source == "loop process"
        watchdog.acknowledge()
        assert watchdog.tripped is None
        watchdog.feed()
        wait_for(lambda: watchdog.tripped)


STOPPER = "from pathlib import Path\ndef stop():\n    Path({!r}).touch()\n"
HOST = """
import sys
from palpate.core.ports.contracts import FakeClock
from tests.fake_devices import FakeArm
from palpate.adapters.hardware.watchdogs import ProcessWatchdog
clock = FakeClock()
arm = FakeArm(clock, (0.0,), lower_rad=(-1.0,), upper_rad=(1.0,), max_step_rad=0.1)
watchdog = ProcessWatchdog(arm, clock, 600.0, stop_function="stopper:stop", signal_number=0)
watchdog.open()
watchdog.feed()
print("fed", flush=True)
sys.stdin.read()
"""


def test_a_host_that_is_killed_leaves_the_function(tmp_path: Path) -> None:
    (tmp_path / "stopper.py").write_text(STOPPER.format(str(tmp_path / "stopped")))
    paths = os.pathsep.join([str(tmp_path), *(p for p in sys.path if p)])
    host = subprocess.Popen(
        [sys.executable, "-c", HOST],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": paths},
    )
    assert host.stdout is not None
    assert host.stdin is not None
    assert host.stdout.readline() == b"fed\n"
    host.send_signal(signal.SIGKILL)
    host.wait()
    wait_for((tmp_path / "stopped").exists)
    host.stdin.close()
    host.stdout.close()


def test_a_watchdog_that_dies_stops_the_arm() -> None:
    clock, told = FakeClock(), list[WatchdogTrip]()
    arm = active_arm(clock)
    with nothing_left_behind():
        watchdog = ProcessWatchdog(arm, clock, LONG_S, signal_number=0, tell=told.append)
        watchdog.open()
        assert watchdog._process is not None
        watchdog._process.kill()
        wait_for(lambda: watchdog.tripped)
        assert "has died" in told[0].text or "does not listen" in told[0].text
        assert arm.stops
        watchdog.close()
        watchdog.close()


def test_a_function_that_is_not_there_is_refused(capfd: pytest.CaptureFixture[str]) -> None:
    arm = active_arm(FakeClock())
    watchdog = ProcessWatchdog(arm, FakeClock(), LONG_S, stop_function="no_such_module:stop")
    with nothing_left_behind(), pytest.raises(ConfigurationError, match=r"watchdog\.stop_function"):
        watchdog.open()
    assert "watchdog process: No module named" in capfd.readouterr().err


def test_it_must_be_open_to_be_fed() -> None:
    watchdog = ProcessWatchdog(active_arm(FakeClock()), FakeClock(), LONG_S)
    with pytest.raises(LifecycleError, match="not open"):
        watchdog.feed()
    assert watchdog.tripped is None
    with watchdog, pytest.raises(LifecycleError, match="close it first"):
        watchdog.open()


def test_limits_must_make_sense() -> None:
    with pytest.raises(ConfigurationError, match="timeout_s"):
        ProcessWatchdog(active_arm(FakeClock()), FakeClock(), 0.0)
