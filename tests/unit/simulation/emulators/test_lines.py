"""Serial lines in virtual time and on pseudo-terminals; a CAN bus behind a serial adapter."""

import os
import threading

import pytest
import serial

from palpate.simulation.emulators.lines import BusFrame, EmulatedCanBus, PtyServer, SlcanAdapter
from palpate.simulation.emulators.nmc.bus import NmcChain
from tests.support.ideal_motors import IdealPlant
from tests.unit.simulation.emulators.nmc_host import ALL, command


class Echo:
    """Answers every line."""

    def __init__(self, baud=115_200):
        self.baud, self._line = baud, b""

    def feed(self, data, now_ns):
        self._line += data
        if not self._line.endswith(b"\n"):
            return b""
        line, self._line = self._line, b""
        return line

    def advance(self, now_ns):
        return b""


@pytest.fixture
def nothing_leaks():
    files, threads = len(os.listdir("/proc/self/fd")), threading.active_count()
    yield
    assert (len(os.listdir("/proc/self/fd")), threading.active_count()) == (files, threads)


def connect(path, baud=115_200):
    return serial.Serial(path, baudrate=baud, timeout=10.0)


@pytest.mark.usefixtures("nothing_leaks")
@pytest.mark.parametrize("baud", [115_200, 250_000])  # the second has no name in termios
def test_every_byte_value_passes_a_terminal(baud):
    everything = bytes(value for value in range(256) if value != 10) + b"\n"
    with PtyServer(Echo(baud), paced=False) as server, connect(server.path, baud) as port:
        port.write(everything)
        assert port.read(256) == everything


@pytest.mark.usefixtures("nothing_leaks")
def test_unplugging_a_terminal_is_a_hang_up_while_the_device_keeps_its_state():
    chain = NmcChain(IdealPlant())
    with PtyServer(chain, paced=False) as server:
        with connect(server.path, 19_200) as port:
            port.write(command(0, 0x1, bytes([1, ALL])))
            assert port.read(2) == b"\x19\x19"
            hand = threading.Timer(0.1, server.unplug)
            hand.start()
            with pytest.raises((serial.SerialException, OSError)):
                port.read(1)
            hand.join()
        with pytest.raises(OSError, match="not plugged in"):
            _ = server.path
        server.unplug()
    assert chain.modules[0].address == 1


class Talker:
    """A node that sends given frames, and answers 0x10."""

    def __init__(self):
        self.outbox = []
        self.heard = []

    def feed(self, arbitration_id, data, now_ns):
        self.heard.append(arbitration_id)
        return [BusFrame(arbitration_id + 1, data)] if arbitration_id == 0x10 else []

    def advance(self, now_ns):
        out, self.outbox = self.outbox, []
        return out


def opened(*nodes):
    adapter = SlcanAdapter(EmulatedCanBus(nodes))
    assert adapter.feed(b"S8\rO\r", 0) == b"\r\r"
    return adapter


def test_adapter_takes_frames_whole_or_in_pieces():
    node = Talker()
    adapter = opened(node)
    assert adapter.feed(b"t2016C80010270000\r", 0) == b"z\r"
    assert adapter.feed(b"t08", 0) == b""
    assert adapter.feed(b"00\rt0", 0) == b"z\r"
    assert node.heard == [0x201, 0x080]
    node.outbox = [BusFrame(0x601, bytes.fromhex("01AB"))]
    assert adapter.advance(0) == b"t601201AB\r"
    assert adapter.feed(b"102ABCD\r", 0) == b"z\rt0112ABCD\r"
