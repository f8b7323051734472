"""The line between host and device: rates, the time that bytes take, what goes wrong; in virtual time."""

import pytest

from palpate.simulation.emulators.lines.serial_line import LineSpeed, SerialEmulator
from palpate.simulation.emulators.nmc.bus import NmcChain
from tests.support.ideal_motors import IdealPlant
from tests.unit.simulation.emulators.lines.echo import Echo
from tests.unit.simulation.emulators.nmc_host import ALL, address_all, command
from tests.virtual_lines import VirtualPort
from tests.virtual_time import VirtualTime

NOP = command(1, 0xE)
DIVISORS = {115_200: bytes([10]), 230_400: bytes([5])}


class Host:
    """A host on a line, and the time that it took."""

    def __init__(self, emulator: SerialEmulator, timing: LineSpeed | None = None, baud: int | None = None) -> None:
        self.clock = VirtualTime()
        self.port = VirtualPort(self.clock, emulator, timing or LineSpeed(paced=False))
        self.port.baudrate = baud or emulator.baud
        self.port.timeout = 0.1
        self.clock.devices.append(self.port)

    def exchange(self, data: bytes, size: int = 2) -> bytes:
        self.port.write(data)
        return self.port.read(size)

    def takes_s(self, data: bytes, size: int) -> float:
        start_ns = self.clock.now_ns()
        assert len(self.exchange(data, size)) == size
        return (self.clock.now_ns() - start_ns) * 1e-9

    def follow(self, baud: int) -> None:
        """Go to another rate and complete whatever frame the modules made of what they heard before."""
        self.port.baudrate = baud
        self.port.reset_input_buffer()
        self.port.write(bytes(30))
        self.port.read(100)


@pytest.fixture
def echo() -> Host:
    return Host(Echo())


@pytest.fixture
def nmc() -> Host:
    host = Host(NmcChain(IdealPlant()))
    address_all(host.exchange)
    return host


def test_a_change_of_rate(nmc: Host) -> None:
    assert nmc.exchange(command(ALL, 0xA, bytes([10]))) == b""
    assert nmc.port.line.emulator.baud == 115_200
    assert nmc.exchange(NOP) != b"\x19\x19"  # the host is still at 19200
    nmc.follow(115_200)
    assert nmc.exchange(NOP) == b"\x19\x19"
    # 57600 is not close enough either.
    for wrong in (57_600, 100_000):
        nmc.port.baudrate = wrong
        assert nmc.exchange(NOP) != b"\x19\x19"
    nmc.follow(115_200)
    assert nmc.exchange(NOP) == b"\x19\x19"


def test_a_spontaneous_message_at_the_wrong_rate_is_garbage() -> None:
    host = Host(Echo(), baud=19_200)
    host.port.line.emulator.spontaneous = bytes(60)
    received = host.port.read(60)
    assert len(received) == 10
    assert received != bytes(10)


@pytest.mark.parametrize("baud", [9_600, 115_200])
def test_bytes_take_their_time(baud: int) -> None:
    host = Host(Echo(baud), LineSpeed())
    taken = [host.takes_s(bytes(39) + b"\n", 40) for _ in range(5)]
    # There and back; received bytes are taken in grains of half a millisecond.
    least_s = 2 * 40 * 10 / baud
    assert min(taken) >= least_s - 1e-6
    assert max(taken) <= least_s + 0.0005


def test_a_usb_adapter_delivers_when_its_timer_ends() -> None:
    host = Host(Echo(), LineSpeed(paced=False, usb_latency_s=0.016))
    host.exchange(b"\n", 1)
    for _ in range(10):
        host.clock.sleep(0.004)
        assert host.takes_s(b"\n", 1) == pytest.approx(0.012)
    # A full packet does not wait.
    assert max(host.takes_s(bytes(69) + b"\n", 70) for _ in range(10)) <= 0.001
