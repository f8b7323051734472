"""Every way in which an operator may stop the arm."""

import hashlib
import os
import pty
import signal
import socket
import termios
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from palpate.adapters.hardware.watchdogs import GuardedArm, OperatorSources, OperatorStop, WatchdogTrip
from palpate.adapters.hardware.watchdogs.sources import SocketSource
from palpate.core.errors import ConfigurationError, FaultLatchedError, LifecycleError
from palpate.core.ports.contracts import FakeClock
from palpate.core.ports.values import CommandReason
from tests.unit.adapters.hardware.watchdogs.bench import HERE, StoppedArm, active_arm, nothing_left_behind, wait_for

NOTHING = OperatorSources(keys=False, signal_number=None)


class Bench:
    def __init__(self, sources: OperatorSources = NOTHING, terminal_fd: int = 0) -> None:
        self.clock = FakeClock()
        self.arm: StoppedArm = active_arm(self.clock)
        self.told: list[WatchdogTrip] = []
        self.stop = OperatorStop(self.arm, self.clock, sources, tell=self.told.append, terminal_fd=terminal_fd)

    def require_stop(self, source: str, text: str) -> None:
        wait_for(lambda: self.told)
        assert self.stop.tripped == self.told[-1]
        assert self.told[-1].source == source
        assert text in self.told[-1].text
        assert self.arm.send(HERE).reason is CommandReason.STOPPED


@pytest.fixture
def terminal() -> Iterator[tuple[int, int]]:
    master, slave = pty.openpty()
    yield master, slave
    for fd in (master, slave):
        try:
            os.close(fd)
        except OSError:
            continue  # the test has closed it


def test_a_key(terminal: tuple[int, int]) -> None:
    master, slave = terminal
    before = termios.tcgetattr(slave)
    bench = Bench(OperatorSources(signal_number=None), slave)
    with nothing_left_behind(), bench.stop:
        assert bench.stop.active == ("key",)
        assert not termios.tcgetattr(slave)[3] & termios.ICANON
        assert termios.tcgetattr(slave)[3] & termios.ISIG  # Ctrl-C keeps its meaning
        os.write(master, b"x")
        bench.require_stop("key", "a key was pressed")
    assert termios.tcgetattr(slave) == before


def test_a_terminal_that_goes_away(terminal: tuple[int, int]) -> None:
    master, slave = terminal
    bench = Bench(OperatorSources(signal_number=None), slave)
    with bench.stop:
        os.close(master)
        bench.require_stop("key", "the terminal is gone")


def test_without_a_terminal_there_are_no_keys() -> None:
    read_fd, write_fd = os.pipe()
    with Bench(OperatorSources(signal_number=None), read_fd).stop as stop:
        assert stop.active == ()
    os.close(read_fd)
    os.close(write_fd)
    with Bench(OperatorSources(signal_number=None), read_fd).stop as stop:
        assert stop.active == ()


@pytest.mark.parametrize("number", [signal.SIGUSR1, signal.SIGUSR2])
def test_a_signal(number: int) -> None:
    before = signal.getsignal(number)
    bench = Bench(OperatorSources(keys=False, signal_number=number))
    with nothing_left_behind(), bench.stop:
        assert bench.stop.active == ("signal",)
        os.kill(os.getpid(), number)
        bench.require_stop("signal", signal.Signals(number).name)
        assert "MainThread" in bench.arm.stops  # the handler itself, at once
        assert len(bench.told) == 1
    assert signal.getsignal(number) is before


def test_a_signal_while_the_main_thread_is_stuck() -> None:
    bench = Bench(OperatorSources(keys=False))
    with bench.stop:

        def stopped_by_the_thread() -> bool:
            bench.stop.acknowledge()
            bench.arm.stops.clear()
            sender = threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGUSR1))
            sender.start()
            # In C, without a look at signals: no handler runs before this is done.
            hashlib.pbkdf2_hmac("sha256", b"", b"", 1_000_000)
            sender.join()
            bench.require_stop("signal", "SIGUSR1")
            return bench.arm.stops[0] == "operator stop"

        wait_for(stopped_by_the_thread)


def test_another_signal_is_none_of_its_business() -> None:
    bench = Bench(OperatorSources(keys=False))
    came: list[int] = []
    before = signal.signal(signal.SIGUSR2, lambda number, frame: came.append(number))
    try:
        with bench.stop:
            os.kill(os.getpid(), signal.SIGUSR2)
            wait_for(lambda: came)
            bench.stop.stop("enough")
            bench.require_stop("program", "enough")
    finally:
        signal.signal(signal.SIGUSR2, before)


def test_a_signal_where_an_event_loop_has_taken_the_wakeup() -> None:
    read_fd, write_fd = os.pipe()
    os.set_blocking(write_fd, False)
    bench = Bench(OperatorSources(keys=False))
    signal.set_wakeup_fd(write_fd)
    try:
        with bench.stop:
            os.kill(os.getpid(), signal.SIGUSR1)
            bench.require_stop("signal", "SIGUSR1")
    finally:
        assert signal.set_wakeup_fd(-1) == write_fd
        os.close(read_fd)
        os.close(write_fd)


def test_a_handler_that_interrupts_stops_again_and_again() -> None:
    bench = Bench(OperatorSources(keys=False))
    with bench.stop:
        for _ in range(200):
            os.kill(os.getpid(), signal.SIGUSR1)
            bench.stop.stop()
        bench.require_stop("signal", "SIGUSR1")
    assert len(bench.told) == 1


def test_signals_belong_to_the_main_thread() -> None:
    bench = Bench(OperatorSources(keys=False))
    refused: list[Exception] = []

    def in_thread(action: str) -> None:
        def run() -> None:
            try:
                getattr(bench.stop, action)()
            except (ConfigurationError, LifecycleError) as error:
                refused.append(error)

        thread = threading.Thread(target=run)
        thread.start()
        thread.join()

    with nothing_left_behind():
        in_thread("open")
    assert "main thread" in str(refused[0])
    bench = Bench(OperatorSources(keys=False))
    with bench.stop:
        in_thread("close")
        assert "main thread" in str(refused[1])
        os.kill(os.getpid(), signal.SIGUSR1)
        bench.require_stop("signal", "SIGUSR1")


def test_a_signal_that_cannot_be_handled_is_refused() -> None:
    bench = Bench(OperatorSources(keys=False, signal_number=signal.SIGKILL))
    with nothing_left_behind(), pytest.raises(ConfigurationError, match=r"operator_stop\.signal"):
        bench.stop.open()


def test_a_file_trips_until_it_is_gone(tmp_path: Path) -> None:
    file = tmp_path / "stop"
    bench = Bench(OperatorSources(keys=False, signal_number=None, file=file, poll_s=0.002))
    with nothing_left_behind(), bench.stop:
        assert bench.stop.active == ("file",)
        assert bench.stop.tripped is None
        file.touch()
        bench.require_stop("file", f"{file} is there")
        bench.stop.acknowledge()
        wait_for(lambda: len(bench.told) == 2)
        file.unlink()
        bench.stop.acknowledge()
        time.sleep(0.02)
        assert bench.stop.tripped is None


def test_a_file_in_no_folder_is_refused(tmp_path: Path) -> None:
    with nothing_left_behind(), pytest.raises(ConfigurationError, match=r"operator\.file = .*/none/stop' is refused"):
        Bench(OperatorSources(keys=False, signal_number=None, file=tmp_path / "none/stop")).stop.open()


def test_a_file_that_nobody_could_find_counts(tmp_path: Path) -> None:
    bench = Bench(OperatorSources(keys=False, signal_number=None, file=tmp_path / ("x" * 300)))
    with bench.stop:
        bench.require_stop("file", "cannot be looked for")


@pytest.mark.parametrize(("said", "text"), [(b"", "a connection"), (b"red button\n", "a connection: red button")])
def test_a_connection(tmp_path: Path, said: bytes, text: str) -> None:
    path = tmp_path / "stop.sock"
    bench = Bench(OperatorSources(keys=False, signal_number=None, socket=path))
    with nothing_left_behind(), bench.stop:
        assert bench.stop.active == ("socket",)
        with socket.socket(socket.AF_UNIX) as button:
            # What is sent may come after the arm was stopped already: a connection is enough.
            button.connect(str(path))
            if said:
                button.send(said)
            assert button.recv(20) == b"stopped\n"
            assert bench.arm.stops
        bench.require_stop("socket", "a connection")
    assert bench.told[0].text in (text, "a connection")
    assert not path.exists()


def test_a_socket_that_fails_counts(tmp_path: Path) -> None:
    source = SocketSource(tmp_path / "stop.sock")
    assert source.look() is None
    assert source.open()
    assert source._server is not None
    source._server.close()
    assert "the socket fails" in (source.look() or "")
    assert source.fd is None
    source.close()


def test_an_orphaned_socket_is_replaced_and_a_served_one_is_not(tmp_path: Path) -> None:
    path = tmp_path / "stop.sock"
    orphan = socket.socket(socket.AF_UNIX)
    orphan.bind(str(path))
    orphan.close()
    sources = OperatorSources(keys=False, signal_number=None, socket=path)
    with nothing_left_behind(), Bench(sources).stop, pytest.raises(ConfigurationError, match=r"operator\.socket"):
        Bench(sources).stop.open()


def test_a_file_in_the_sockets_place_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "letter"
    path.write_text("dear sir")
    with nothing_left_behind(), pytest.raises(ConfigurationError, match=r"operator\.socket"):
        Bench(OperatorSources(keys=False, signal_number=None, socket=path)).stop.open()
    assert path.read_text() == "dear sir"


def test_all_sources_at_once_tell_which(tmp_path: Path, terminal: tuple[int, int]) -> None:
    sources = OperatorSources(file=tmp_path / "stop", socket=tmp_path / "stop.sock")
    bench = Bench(sources, terminal[1])
    with nothing_left_behind(), bench.stop:
        assert bench.stop.active == ("key", "file", "socket", "signal")
        os.write(terminal[0], b" ")
        bench.require_stop("key", "pressed")
        # The first stays, although the others stop too.
        (tmp_path / "stop").touch()
        os.kill(os.getpid(), signal.SIGUSR1)
        assert bench.stop.tripped == bench.told[0]
    assert bench.stop.active == ()


def test_it_latches_until_a_person_acknowledges() -> None:
    bench = Bench()
    guarded = GuardedArm(bench.arm, [bench.stop])
    with bench.stop:
        bench.stop.stop("by hand")
        bench.require_stop("program", "by hand")
        guarded.deactivate()
        with pytest.raises(FaultLatchedError, match="program: by hand"):
            guarded.activate()
        bench.stop.acknowledge()
        guarded.activate()
        assert guarded.send(HERE).reason is CommandReason.AS_ASKED
        bench.stop.stop("once more")
        wait_for(lambda: len(bench.told) == 2)


def test_it_stops_before_it_is_open_and_after_it_is_closed() -> None:
    bench = Bench()
    bench.stop.stop()
    with bench.stop:
        assert bench.stop.tripped is not None
    bench.stop.close()
    bench.stop.stop()
    assert len(bench.arm.stops) == 2
    with pytest.raises(LifecycleError):
        bench.stop.open()


def test_waiting_takes_no_time_of_the_processor(tmp_path: Path, terminal: tuple[int, int]) -> None:
    bench = Bench(OperatorSources(socket=tmp_path / "stop.sock"), terminal[1])
    with bench.stop:
        # Once its thread lies in its wait, nothing wakes it.
        [thread] = [t for t in threading.enumerate() if t.name == "operator stop"]
        assert thread.daemon
        task = Path(f"/proc/self/task/{thread.native_id}/status")

        def sleeps_on() -> bool:
            before = [line for line in task.read_text().splitlines() if "switches" in line]
            time.sleep(0.2)
            return [line for line in task.read_text().splitlines() if "switches" in line] == before

        wait_for(sleeps_on)
