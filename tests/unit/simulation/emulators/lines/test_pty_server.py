"""Emulators behind a pseudo-terminal: bytes, hosts that come and go, unplugging."""

import os
import threading
import time
from collections.abc import Iterator

import pytest
import serial

from palpate.simulation.emulators.lines import LineSpeed, PtyServer
from palpate.simulation.emulators.nmc.bus import NmcChain
from tests.support.ideal_motors import IdealPlant
from tests.unit.simulation.emulators.lines.echo import Echo
from tests.unit.simulation.emulators.nmc_host import address_all, command

AT_ONCE = LineSpeed(paced=False)
NOP = command(1, 0xE)


def open_fds() -> int:
    return len(os.listdir("/proc/self/fd"))


@pytest.fixture(autouse=True)
def nothing_leaks() -> Iterator[None]:
    fds, threads = open_fds(), threading.active_count()
    yield
    assert open_fds() == fds
    assert threading.active_count() == threads


@pytest.fixture
def echo() -> Iterator[PtyServer[Echo]]:
    with PtyServer(Echo(), AT_ONCE) as server:
        yield server


@pytest.fixture
def nmc() -> Iterator[PtyServer[NmcChain]]:
    with PtyServer(NmcChain(IdealPlant()), AT_ONCE) as server:
        yield server


def connect(path: str, baud: int = 115_200, timeout: float = 10.0) -> serial.Serial:
    return serial.Serial(path, baudrate=baud, timeout=timeout)


def exchange(port: serial.Serial, data: bytes, size: int = 2) -> bytes:
    port.write(data)
    return bytes(port.read(size))


def test_every_byte_value_passes(echo: PtyServer[Echo]) -> None:
    everything = bytes(value for value in range(256) if value != 10) + b"\n"
    with connect(echo.path) as port:
        assert exchange(port, everything, 256) == everything


def test_a_rate_without_a_name_in_termios_is_understood() -> None:
    with PtyServer(Echo(250_000), AT_ONCE) as server, connect(server.path, 250_000) as port:
        assert exchange(port, b"x\n") == b"x\n"


def test_unplugging_is_a_hang_up_and_plugging_in_again_finds_the_device_as_it_was() -> None:
    with PtyServer(NmcChain(IdealPlant()), AT_ONCE) as server:
        with connect(server.path, 19_200) as port:
            address_all(lambda data: exchange(port, data))
            hand = threading.Timer(0.1, server.unplug)
            hand.start()
            with pytest.raises((serial.SerialException, OSError)):
                port.read(1)
            hand.join()
        with pytest.raises(OSError, match="not plugged in"):
            _ = server.path
        server.unplug()
        path = server.replug()
        assert server.replug() == path
        with connect(path, 19_200) as port:
            assert exchange(port, NOP) == b"\x19\x19"


def test_a_server_can_be_started_again_but_not_twice() -> None:
    server = PtyServer(Echo(), AT_ONCE)
    with pytest.raises(RuntimeError, match="not running"):
        server.replug()
    for _ in range(2):
        path = server.start()
        with pytest.raises(RuntimeError, match="is running"):
            server.start()
        with connect(path) as port:
            assert exchange(port, b"x\n") == b"x\n"
        server.stop()
        server.stop()


def test_a_host_that_never_reads_blocks_nobody(echo: PtyServer[Echo]) -> None:
    with connect(echo.path) as port:
        for _ in range(40):
            with echo.exclusive() as emulator:
                emulator.spontaneous = bytes(1_000)
            time.sleep(0.002)
        with echo.exclusive():
            pass
        port.reset_input_buffer()
        port.write(b"y\n")
        assert port.read_until(b"y\n").endswith(b"y\n")
