"""Every way in which an operator may stop the arm."""

import os
import pty
import signal
import termios
import threading

import pytest

from palpate.adapters.contracts import FakeClock
from palpate.adapters.hardware.operator_stop import GuardedArm, OperatorStop
from palpate.core.errors import ConfigurationError, FaultLatchedError, LifecycleError
from palpate.core.ports.values import CommandReason
from tests.support.stopped_arm import HERE, active_arm, nothing_left_behind
from tests.wall_clock.late import wait_for


class Bench:
    def __init__(self, **settings):
        self.arm = active_arm(FakeClock())
        self.message = []
        self.stop = OperatorStop(self.arm, notify=self.message.append, **{"keys": False, **settings})

    def require_stop(self, text):
        wait_for(lambda: self.message)
        assert (self.message, self.stop.tripped) == ([text], text)
        assert self.arm.send(HERE).reason is CommandReason.STOPPED


@pytest.fixture
def terminal():
    master, slave = pty.openpty()
    yield master, slave
    for fd in (master, slave):
        try:
            os.close(fd)
        except OSError:
            continue  # the test has closed it


def test_a_key(terminal):
    master, slave = terminal
    before = termios.tcgetattr(slave)
    bench = Bench(keys=True, terminal_fd=slave)
    with nothing_left_behind(), bench.stop:
        assert not termios.tcgetattr(slave)[3] & termios.ICANON
        assert termios.tcgetattr(slave)[3] & termios.ISIG  # Ctrl-C keeps its meaning
        os.write(master, b"x")
        bench.require_stop("key: a key was pressed")
        bench.stop.acknowledge()
        bench.message.clear()
        os.write(master, b"y")
        bench.require_stop("key: a key was pressed")
    assert termios.tcgetattr(slave) == before


def test_terminal_that_goes_away(terminal):
    master, slave = terminal
    bench = Bench(keys=True, terminal_fd=slave)
    with bench.stop:
        os.close(master)
        bench.require_stop("key: the terminal is gone")


def test_without_a_terminal_there_are_no_keys():
    read_fd, write_fd = os.pipe()
    for is_open in (True, False):
        with Bench(keys=True, terminal_fd=read_fd).stop as stop:
            assert not [thread for thread in threading.enumerate() if thread.name == "operator stop"]
            assert stop.tripped == ""
        if is_open:
            os.close(read_fd)
            os.close(write_fd)


def test_signal_stops_from_its_handler_again_and_again_and_is_told_once():
    before = signal.getsignal(signal.SIGUSR1)
    bench = Bench()
    with nothing_left_behind(), bench.stop:
        for _ in range(200):
            os.kill(os.getpid(), signal.SIGUSR1)
            bench.stop.stop()
        bench.require_stop("signal: signal SIGUSR1")
    assert set(bench.arm.stops) == {"MainThread"}
    assert signal.getsignal(signal.SIGUSR1) is before


def test_it_belongs_to_the_main_thread():
    refused = []

    def enter():
        try:
            Bench().stop.__enter__()
        except ConfigurationError as error:
            refused.append(error)

    with nothing_left_behind():
        thread = threading.Thread(target=enter)
        thread.start()
        thread.join()
    assert "main thread" in str(refused[0])


def test_it_latches_until_a_person_acknowledges():
    bench = Bench()
    guarded = GuardedArm(bench.arm, bench.stop)
    with bench.stop:
        with pytest.raises(LifecycleError):
            bench.stop.__enter__()
        bench.stop.stop("program: by hand")
        bench.require_stop("program: by hand")
        guarded.deactivate()
        with pytest.raises(FaultLatchedError, match="program: by hand"):
            guarded.activate()
        bench.arm.activate()
        assert guarded.send(HERE).reason is CommandReason.STOPPED
        bench.stop.acknowledge()
        guarded.deactivate()
        guarded.activate()
        assert guarded.send(HERE).reason is CommandReason.AS_REQUESTED


def test_arm_that_cannot_be_told_is_latched_all_the_same():
    bench = Bench()
    bench.arm.gone = True
    bench.stop.stop("program: requested")
    assert bench.stop.tripped == "program: requested; stop() failed: DeviceError('arm: is gone')"
