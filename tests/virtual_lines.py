"""Serial lines and CAN buses in virtual time: drivers open them by name, as they open real ones."""

from collections import deque
from types import SimpleNamespace

import can
import canopen
import pytest
import serial

from palpate.drivers.cia402 import mailbox
from palpate.simulation.emulators.lines.can_bus import BusFrame, EmulatedCanBus
from palpate.simulation.emulators.lines.serial_line import SerialLine
from tests.support.cia402_bench import FakeNetwork
from tests.virtual_time import VirtualCondition, VirtualTime

_GRAIN_NS = 1_000_000
"""How often nodes live that are not spoken to, as behind an adapter."""
_SDO_WAIT_NS = 20_000_000


class VirtualPort:
    """A serial port as of pyserial, with an emulated device at its far end; its cable is whole or cut."""

    def __init__(self, clock, emulator, *, paced=True):
        self.line = SerialLine(emulator, paced=paced)
        self.baudrate = emulator.baud
        self.timeout = None
        self.write_timeout = None
        self._clock, self._arrived = clock, bytearray()
        self._plugged = self.is_whole = True
        self.line.connect(lambda: self.baudrate, clock.now_ns())

    def next_event_ns(self):
        return self.line.next_event_ns()

    def step(self, now_ns):
        for data in self.line.step(now_ns):
            self._arrived += data if self.is_whole else b""

    def put(self, data):
        """Bytes that come from elsewhere."""
        self._arrived += data

    def unplug(self):
        """Pull the adapter out; what waits in it is gone."""
        self._plugged = False
        self._arrived.clear()
        self.line.disconnect()

    @property
    def in_waiting(self):
        self._check()
        return len(self._arrived)

    def read(self, size=1, /):
        self._check()
        deadline_ns = self._clock.now_ns() + round((self.timeout or 0.0) * 1e9)
        self._clock.wait_for(lambda: len(self._arrived) >= size or not self._plugged, deadline_ns)
        self._check()
        data = bytes(self._arrived[:size])
        del self._arrived[:size]
        return data

    def write(self, data, /):
        self._check()
        if self.is_whole:
            self.line.receive(data, self._clock.now_ns())
        return len(data)

    def reset_input_buffer(self):
        self._check()
        self._arrived.clear()

    def close(self):
        """The next host finds the device as it is."""

    def _check(self):
        if not self._plugged:
            raise serial.SerialException("the emulated port is not plugged in")


class VirtualCan:
    """A CAN bus with emulated nodes; hosts hear every frame of the nodes."""

    def __init__(self, clock, nodes, **options):
        self.wire = EmulatedCanBus(tuple(nodes), **options)
        self.hosts = []
        self.is_whole = True
        self._clock, self._next_ns = clock, 0

    def next_event_ns(self):
        return self._next_ns

    def step(self, now_ns):
        for frame in self.wire.advance(now_ns):
            for host in self.hosts if self.is_whole else ():
                host(frame)
        self._next_ns = now_ns + _GRAIN_NS

    def send(self, identifier, data):
        now_ns = self._clock.now_ns()
        if self.is_whole:
            self.wire.send(BusFrame(identifier, data))
        self._next_ns = min(self._next_ns, now_ns + 1)


class VirtualCanBus(can.BusABC):
    """The way of python-can to such a bus; only for hosts that poll."""

    def __init__(self, bus):
        super().__init__(None)
        self.wire = bus
        self._heard = deque()
        bus.hosts.append(self._heard.append)

    def send(self, msg, timeout=None):
        self.wire.send(msg.arbitration_id, bytes(msg.data))

    def _recv_internal(self, timeout):
        if not self._heard:
            return None, False
        frame = self._heard.popleft()
        return can.Message(arbitration_id=frame.arbitration_id, data=frame.data, is_extended_id=False), False

    def shutdown(self):
        super().shutdown()
        if self._heard.append in self.wire.hosts:
            self.wire.hosts.remove(self._heard.append)


class VirtualNetwork(FakeNetwork):
    """The network on an emulated bus; receives without a thread of its own."""

    def __init__(self, clock, opened):
        super().__init__(())
        self._clock, self._opened, self._bus = clock, opened, None
        self.listeners = []
        self.notifier = None

    def connect(self):
        # Frames are heard here from now on, and not kept for who polls.
        self._opened.shutdown()
        self._bus = self._opened.wire
        self._bus.hosts.append(self._hear)
        self.notifier = SimpleNamespace(exception=None, stopped=False)

    def disconnect(self):
        self.notifier.stopped = True
        if self._bus is not None:
            self._bus.hosts.remove(self._hear)
            self._bus = None

    def send_message(self, can_id, data, remote=False):
        if self._bus is None:
            raise can.CanOperationError("the bus is closed")
        self._bus.send(can_id, bytes(data))
        if 0x600 < can_id <= 0x67F:
            # canopen waits for the answer on a queue that knows no virtual time: it has to be there when it looks.
            answered = SimpleNamespace(count=0)

            def count(frame):
                answered.count += frame.arbitration_id == can_id - 0x80

            self._bus.hosts.append(count)
            self._clock.wait_for(lambda: answered.count > 0, self._clock.now_ns() + _SDO_WAIT_NS)
            self._bus.hosts.remove(count)

    def _hear(self, frame):
        self.deliver([frame])


class Cable:
    """Between an adapter and its device: cut and joined by name, with time to notice."""

    def __init__(self, clock, wire, noticed_s):
        self._clock, self._wire, self._noticed_s = clock, wire, noticed_s

    def cut(self):
        """Nothing goes through any more."""
        self._wire.is_whole = False
        self._clock.sleep(self._noticed_s)

    def join(self):
        """All goes through again."""
        self._wire.is_whole = True


class VirtualDesk:
    """A computer in virtual time: what drivers open of serial ports and CAN buses is looked up here.

    Close it in the end: until then pyserial, python-can and canopen open nothing else.
    """

    def __init__(self):
        self.clock = VirtualTime()
        self._ports = {}
        self._buses = {}
        self._patch = pytest.MonkeyPatch()
        self._patch.setattr(serial, "serial_for_url", self._open_port)
        self._patch.setattr(can, "Bus", lambda *, channel, **_: VirtualCanBus(self.bus(channel)))
        self._patch.setattr(canopen, "Network", lambda bus: VirtualNetwork(self.clock, bus))
        condition = SimpleNamespace(Condition=lambda: VirtualCondition(self.clock))
        self._patch.setattr(mailbox, "threading", condition)

    def serial(self, name, emulator):
        """Plug a device in at a serial port."""
        port = VirtualPort(self.clock, emulator)
        self._ports[name] = port
        self.clock.devices.append(port)
        return port

    def port(self, name):
        """The serial port of that name."""
        return self._ports[name]

    def can(self, channel, *nodes, **options):
        """Put nodes on a CAN bus."""
        bus = VirtualCan(self.clock, nodes, **options)
        self._buses[channel] = bus
        self.clock.devices.append(bus)
        return bus

    def bus(self, channel):
        if channel not in self._buses:
            raise can.CanInitializationError(f"no bus {channel}")
        return self._buses[channel]

    def close(self):
        self._patch.undo()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _open_port(self, name, baud, **_):
        if name not in self._ports:
            raise serial.SerialException(f"no port {name}")
        port = self._ports[name]
        port.baudrate = baud
        return port
