"""Emulators behind a pseudo-terminal: bytes, timing, faults, unplugging."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import serial

from palpate.simulation.emulators.lines.faults import Delivery, FaultInjector, SerialFaults
from palpate.simulation.emulators.lines.pty_server import PtyServer
from palpate.simulation.emulators.lines.serial_line import LineSpeed, SerialEmulator
from palpate.simulation.emulators.motors.plant import IdealPlant
from palpate.simulation.emulators.nmc.bus import NmcChain
from tests.unit.simulation.emulators.nmc_host import ALL, address_all, command

AT_ONCE = LineSpeed(paced=False)
NOP = command(1, 0xE)
DIVISORS = {115_200: bytes([10]), 230_400: bytes([5])}


class Echo:
    """Answers every line, and says something by itself when asked to."""

    def __init__(self, baud: int = 115_200) -> None:
        self.baud = baud
        self.spontaneous = b""
        self._line = b""

    def feed(self, data: bytes, now_ns: int) -> bytes:
        self._line += data
        if not self._line.endswith(b"\n"):
            return b""
        line, self._line = self._line, b""
        return line

    def advance(self, now_ns: int) -> bytes:
        said, self.spontaneous = self.spontaneous, b""
        return said


def as_emulator(emulator: SerialEmulator) -> SerialEmulator:
    return emulator


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
    with PtyServer(Echo(), AT_ONCE, seed=3) as server:
        yield server


@pytest.fixture
def nmc() -> Iterator[PtyServer[NmcChain]]:
    with PtyServer(NmcChain(IdealPlant()), AT_ONCE, seed=3) as server:
        yield server


def connect(path: str, baud: int = 115_200, timeout: float = 1.0) -> serial.Serial:
    return serial.Serial(path, baudrate=baud, timeout=timeout)


def exchange(port: serial.Serial, data: bytes, size: int = 2) -> bytes:
    port.write(data)
    return bytes(port.read(size))


def change_rate(nmc: PtyServer[NmcChain], port: serial.Serial, divisor: int, baud: int) -> None:
    """Address the modules, send them to another rate, and leave the host at the old one."""
    address_all(lambda data: exchange(port, data))
    assert exchange(port, command(ALL, 0xA, bytes([divisor]))) == b""
    with nmc.exclusive() as bus:
        assert bus.baud == baud


def follow(port: serial.Serial, baud: int) -> None:
    """Take the host to that rate and complete whatever frame the modules made of what they heard before."""
    port.baudrate = baud
    port.reset_input_buffer()
    port.write(bytes(30))


def test_every_byte_value_passes(echo: PtyServer[Echo]) -> None:
    everything = bytes(value for value in range(256) if value != 10) + b"\n"
    with connect(echo.path) as port:
        assert exchange(port, everything, 256) == everything


def test_what_the_device_says_by_itself_arrives(echo: PtyServer[Echo]) -> None:
    as_emulator(Echo())
    with connect(echo.path) as port:
        with echo.exclusive() as emulator:
            emulator.spontaneous = b"hello"
        assert port.read(5) == b"hello"


def test_hosts_come_and_go(nmc: PtyServer[NmcChain]) -> None:
    with connect(nmc.path, 19_200) as port:
        address_all(lambda data: exchange(port, data))
    with connect(nmc.path, 19_200) as port:
        assert exchange(port, NOP) == b"\x19\x19"


def test_a_change_of_rate(nmc: PtyServer[NmcChain]) -> None:
    with connect(nmc.path, 19_200, timeout=0.1) as port:
        change_rate(nmc, port, 10, 115_200)
        assert exchange(port, NOP) != b"\x19\x19"  # the host is still at 19200
        assert nmc.faults.injected["baud_mismatch"] >= 1
        follow(port, 115_200)
        assert exchange(port, NOP) == b"\x19\x19"
        # 57600 is not close enough either, nor is a rate that termios has no name for.
        for wrong in (57_600, 100_000):
            port.baudrate = wrong
            assert exchange(port, NOP) != b"\x19\x19"
        follow(port, 115_200)
        port.read(100)
        assert exchange(port, NOP) == b"\x19\x19"


def test_a_rate_without_a_name_is_understood(nmc: PtyServer[NmcChain]) -> None:
    with connect(nmc.path, 19_200, timeout=0.1) as port:
        change_rate(nmc, port, 4, 250_000)
        follow(port, 250_000)
        port.read(100)
        assert exchange(port, NOP) == b"\x19\x19"


def test_a_spontaneous_message_at_the_wrong_rate_is_garbage(echo: PtyServer[Echo]) -> None:
    with connect(echo.path, 19_200, timeout=0.2) as port:
        with echo.exclusive() as emulator:
            emulator.spontaneous = bytes(60)
        received = port.read(60)
        assert len(received) == 10
        assert received != bytes(10)


@pytest.mark.parametrize(("baud", "least_s"), [(9_600, 2 * 40 * 10 / 9_600), (115_200, 2 * 40 * 10 / 115_200)])
def test_bytes_take_their_time(baud: int, least_s: float) -> None:
    with PtyServer(Echo(baud), LineSpeed(turnaround_s=0.002)) as server, connect(server.path, baud) as port:
        line = bytes(39) + b"\n"
        taken = []
        for _ in range(5):
            start = time.monotonic()
            assert exchange(port, line, 40) == line
            taken.append(time.monotonic() - start)
    assert min(taken) >= least_s + 0.002
    assert min(taken) < least_s + 0.002 + 0.05


def test_a_usb_adapter_delivers_when_its_timer_ends() -> None:
    timing = LineSpeed(paced=False, usb_latency_s=0.016)
    with PtyServer(Echo(), timing) as server, connect(server.path) as port:
        exchange(port, b"\n", 1)
        start = time.monotonic()
        for _ in range(10):
            assert exchange(port, b"\n", 1) == b"\n"
        assert time.monotonic() - start > 0.14
        # A full packet does not wait; of many, most must beat the timer.
        taken = []
        for _ in range(10):
            start = time.monotonic()
            assert exchange(port, bytes(69) + b"\n", 70) == bytes(69) + b"\n"
            taken.append(time.monotonic() - start)
    assert min(taken) < 0.010


def test_silence(echo: PtyServer[Echo]) -> None:
    with connect(echo.path, timeout=0.1) as port:
        echo.faults.faults = SerialFaults(silent=True)
        assert exchange(port, b"a\n") == b""
        echo.faults.faults = SerialFaults()
        assert exchange(port, b"b\n") == b"b\n"
        assert echo.faults.injected["silent"] == 1


def test_lost_late_and_doubled_replies(echo: PtyServer[Echo]) -> None:
    with connect(echo.path, timeout=0.1) as port:
        echo.faults.faults = SerialFaults(drop_reply=1.0)
        assert exchange(port, b"a\n") == b""
        echo.faults.faults = SerialFaults(duplicate_reply=1.0)
        assert exchange(port, b"a\n", 5) == b"a\na\n"
        echo.faults.faults = SerialFaults(delay_reply=1.0, delay_s=0.2)
        assert exchange(port, b"a\n") == b""
        port.timeout = 1.0
        assert port.read(2) == b"a\n"


def test_wrong_checksums_and_lost_commands(nmc: PtyServer[NmcChain]) -> None:
    with connect(nmc.path, 19_200, timeout=0.1) as port:
        address_all(lambda data: exchange(port, data))
        nmc.faults.faults = SerialFaults(wrong_checksum=1.0)
        status, checksum = exchange(port, NOP)
        assert status == 0x19
        assert checksum != status
        nmc.faults.faults = SerialFaults(drop_command_byte=1.0)
        assert exchange(port, NOP) == b""
        nmc.faults.faults = SerialFaults()
        assert exchange(port, NOP) == b"\x19\x19"


def test_faults_of_the_device_in_mid_run(nmc: PtyServer[NmcChain]) -> None:
    with connect(nmc.path, 19_200, timeout=0.1) as port:
        address_all(lambda data: exchange(port, data))
        with nmc.exclusive() as bus:
            bus.modules[0].servo.overcurrent = True
            bus.modules[1].power_up()
            bus.modules[2].muted = True
        assert exchange(port, NOP) == b"\x1d\x1d"
        assert exchange(port, command(2, 0xE)) == b""
        assert exchange(port, command(3, 0xE)) == b""
        assert exchange(port, command(4, 0xE)) == b"\x19\x19"


def test_unplugging_is_a_hang_up_and_plugging_in_again_finds_the_device_as_it_was(tmp_path: Path) -> None:
    link = tmp_path / "arm"
    with PtyServer(NmcChain(IdealPlant()), AT_ONCE, link=link) as server:
        assert server.path == str(link)
        with connect(str(link), 19_200) as port:
            address_all(lambda data: exchange(port, data))
            threading.Timer(0.1, server.unplug).start()
            with pytest.raises((serial.SerialException, OSError)):
                port.read(1)
        assert not link.is_symlink()
        with pytest.raises(OSError, match="not plugged in"):
            _ = server.path
        server.unplug()
        assert server.replug() == str(link)
        assert server.replug() == str(link)
        with connect(str(link), 19_200) as port:
            assert exchange(port, NOP) == b"\x19\x19"
    assert not link.is_symlink()


def test_a_link_never_replaces_a_file(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("precious")
    server = PtyServer(Echo(), AT_ONCE, link=file)
    with pytest.raises(FileExistsError):
        server.start()
    assert file.read_text() == "precious"


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
        deadline = time.monotonic() + 2.0
        while port.read(1) == b"\0" and time.monotonic() < deadline:
            port.reset_input_buffer()
            if exchange(port, b"y\n") == b"y\n":
                break
        assert time.monotonic() < deadline


@pytest.mark.parametrize(
    "field", ["drop_byte", "corrupt_byte", "duplicate_byte", "drop_reply", "duplicate_reply", "wrong_checksum"]
)
def test_faults_strike_as_often_as_asked_and_alike_for_one_seed(field: str) -> None:
    def run() -> tuple[list[list[Delivery]], int]:
        injector = FaultInjector(np.random.default_rng(7))
        injector.faults = SerialFaults(**{field: 0.25})
        sent = [injector.on_reply(b"\x00\x11\x22\x33") for _ in range(1_000)]
        return sent, injector.injected[field]

    first, count = run()
    assert run() == (first, count)
    chances = 4_000 if field.endswith("byte") else 1_000
    assert count == pytest.approx(0.25 * chances, rel=0.15)
    untouched = sum(deliveries == [Delivery(b"\x00\x11\x22\x33")] for deliveries in first)
    assert 0 < untouched < 1_000


def test_commands_can_be_corrupted() -> None:
    injector = FaultInjector(np.random.default_rng(7))
    injector.faults = SerialFaults(corrupt_command_byte=1.0)
    assert all(a ^ b in (1, 2, 4, 8, 16, 32, 64, 128) for a, b in zip(injector.on_command(NOP), NOP, strict=True))


@pytest.mark.parametrize("wrong", [{"drop_byte": 1.5}, {"drop_reply": -0.1}, {"delay_s": -1.0}])
def test_impossible_faults_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="out of range"):
        SerialFaults(**wrong)


@pytest.mark.parametrize("baud", [115_200, 230_400])
def test_six_axes_are_polled_no_faster_than_the_wire(baud: int) -> None:
    with PtyServer(NmcChain(IdealPlant())) as server, connect(server.path, 19_200) as port:
        address_all(lambda data: exchange(port, data))
        for number in range(1, 7):
            exchange(port, command(number, 0x2, b"\x01"), 6)
        port.write(command(ALL, 0xA, DIVISORS[baud]))
        time.sleep(0.05)
        port.baudrate = baud
        frames = [command(number, 0x4, b"\x11" + bytes(4)) for number in range(1, 7)]
        start = time.monotonic()
        for _ in range(20):
            for frame in frames:
                assert len(exchange(port, frame, 6)) == 6
        took_s = time.monotonic() - start
    assert len(frames[0]) == 9
    assert took_s >= 20 * 6 * 15 * 10 / baud * 0.99
