"""An emulated CiA 402 servo drive as a node on a CAN bus, with NMT, heartbeat, SDO, PDO, EMCY, and a motor.

It represents a modern refit: there is no evidence that any Zebra Zero had such drives.

Identifiers and NMT codes are standard knowledge (CiA 301, predefined connection set). Process data use the first RPDO,
which takes effect at the next SYNC, and the first TPDO, which is sent at each SYNC. Other PDOs can be disabled.
"""

import enum
import struct
from collections.abc import Callable
from typing import Final

from canopen.sdo import SdoServer
from typing_extensions import override

from palpate.simulation.emulators.cia402 import objects as od
from palpate.simulation.emulators.cia402.servo import POWERED, DriveServo, PowerMachine, PowerState
from palpate.simulation.emulators.lines import BusFrame, CanNode
from palpate.simulation.emulators.motors import JointPlant

EMCY_FOLLOWING_ERROR: Final = 0x8611
EMCY_HEARTBEAT_LOST: Final = 0x8130

_SYNC: Final = 0x080
_EMCY: Final = struct.Struct("<HB5s")
_SDO_BYTES: Final = 8
_MS: Final = 1_000_000
_BOOT_NS: Final = 10 * _MS
_STAY_OPTIONS: Final = (5, 6, 7, 8)
_QUICK_STOP_WORD: Final = 0x0002


class NmtState(enum.IntEnum):
    """NMT states, with their heartbeat values."""

    INITIALISING = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F


_NMT: Final = {0x01: NmtState.OPERATIONAL, 0x02: NmtState.STOPPED, 0x80: NmtState.PRE_OPERATIONAL}
_NMT_RESETS: Final = (0x81, 0x82)


class CanopenDrive(CanNode):
    """An emulated drive. Set ``outgoing`` to a filter that drops, delays, changes or repeats its frames."""

    def __init__(self, node: int, motors: JointPlant, axis: int) -> None:
        self.node = node
        self.outgoing: Callable[[list[BusFrame]], list[BusFrame]] = lambda frames: frames
        self._motors, self._axis = motors, axis
        self._now_ns: int | None = None
        self._out: list[BusFrame] = []
        self._power_up(0)

    @override
    def feed(self, arbitration_id: int, data: bytes, now_ns: int) -> list[BusFrame]:
        if arbitration_id not in self._concerns:
            return []
        self._pass_time(now_ns)
        if self.nmt is not NmtState.INITIALISING:
            self._show()
            self._hear(arbitration_id, data, now_ns)
        return self._flush()

    @override
    def advance(self, now_ns: int) -> list[BusFrame]:
        self._pass_time(now_ns)
        return self._flush()

    def reset(self) -> None:
        """Interrupt the power supply. The state is lost, and the drive then sends a boot-up message."""
        self._power_up(self._now_ns or 0)

    def fail(self, code: int, vendor: bytes = b"") -> None:
        """Report an error and enter the fault state."""
        self._fault()
        self.emergency(code, vendor)

    def emergency(self, code: int, vendor: bytes = b"") -> None:
        """Send only an EMCY message. Code 0 reports that the fault is over."""
        self.objects[0x1001] = int(code & 0xFF00 != 0)
        self._send(0x080 + self.node, _EMCY.pack(code, self.objects[0x1001], vendor))

    def _power_up(self, now_ns: int) -> None:
        self.nmt = NmtState.INITIALISING
        self.machine = PowerMachine()
        self.objects = od.ObjectDictionary(self.node, serial=0x1000 + self.node, written=self._written)
        self._sdo = SdoServer(0x600 + self.node, 0x580 + self.node, self.objects)
        self._sdo.network = self
        self._servo = DriveServo(self._motors, self._axis, self.objects)
        self._ready_ns = now_ns + _BOOT_NS
        self._next_heartbeat_ns = 0
        self._host_heard_ns: int | None = None
        self._pending: bytes | None = None
        self._choose_concerns()

    def _choose_concerns(self) -> None:
        # With six drives most frames are for the other five, and each would cost a step of the servo.
        host = 0x700 + (self.objects.sub(od.CONSUMER_HEARTBEAT, 1) >> 16 & 0x7F)
        rpdo = self.objects.sub(od.RPDO_SETTINGS, 1)
        self._concerns = frozenset((0x000, _SYNC, 0x600 + self.node, host, rpdo))

    def _pass_time(self, now_ns: int) -> None:
        if self._now_ns is None:
            self._now_ns, self._ready_ns = now_ns, now_ns + _BOOT_NS
        elapsed_ns, self._now_ns = max(0, now_ns - self._now_ns), now_ns
        if self.nmt is NmtState.INITIALISING:
            if now_ns >= self._ready_ns:
                self.nmt = NmtState.PRE_OPERATIONAL
                self.machine.wake()
                self._send(0x700 + self.node, b"\x00")
            return
        self._turn(elapsed_ns)
        self._watch_host(now_ns)
        period_ns = self.objects[od.PRODUCER_HEARTBEAT] * _MS
        if period_ns and now_ns >= self._next_heartbeat_ns:
            self._next_heartbeat_ns = now_ns + period_ns
            self._send(0x700 + self.node, bytes((self.nmt,)))

    def _turn(self, elapsed_ns: int) -> None:
        if self.machine.state in POWERED:
            stopping = self.machine.state is not PowerState.ENABLED
            self._servo.advance(elapsed_ns, stopping=stopping)
            if stopping and self._servo.stationary:
                self.machine.stopped(stay=self.objects[od.QUICK_STOP_OPTION] in _STAY_OPTIONS)
            if self._servo.following_error and self.machine.state in (PowerState.ENABLED, PowerState.QUICK_STOP):
                self.fail(EMCY_FOLLOWING_ERROR)

    def _show(self) -> None:
        """Update the status and the position, which are read only when a frame arrives."""
        self.objects[od.STATUSWORD] = self.machine.statusword
        self.objects[od.POSITION] = self._servo.measured

    def _fault(self) -> None:
        if self.machine.state not in POWERED:
            # The motor is already stationary, so the target is its present position.
            self._servo.engage()
        self.machine.fail()

    def _watch_host(self, now_ns: int) -> None:
        if self._host_heard_ns is None:
            return
        timeout_ns = (self.objects.sub(od.CONSUMER_HEARTBEAT, 1) & 0xFFFF) * _MS
        if timeout_ns and now_ns - self._host_heard_ns > timeout_ns:
            self._host_heard_ns = None
            self.emergency(EMCY_HEARTBEAT_LOST)
            option = self.objects[od.HOST_LOST_OPTION]
            if option == 1:
                self._fault()
            elif option in (2, 3):
                self._execute(0 if option == 2 else _QUICK_STOP_WORD)

    def _hear(self, identifier: int, data: bytes, now_ns: int) -> None:
        watched = self.objects.sub(od.CONSUMER_HEARTBEAT, 1) >> 16 & 0x7F
        if identifier == 0 and len(data) == 2 and data[1] in (0, self.node):
            if data[0] in _NMT_RESETS:
                self._power_up(now_ns)
            else:
                self.nmt = _NMT.get(data[0], self.nmt)
        elif identifier == 0x700 + watched and watched:
            self._host_heard_ns = now_ns
        elif identifier == 0x600 + self.node and self.nmt is not NmtState.STOPPED:
            if len(data) == _SDO_BYTES:
                self._sdo.on_request(identifier, data, 0.0)
        elif self.nmt is NmtState.OPERATIONAL:
            if identifier == _SYNC:
                self._sync()
            else:
                self._pending = data

    def _written(self, index: int) -> None:
        self._choose_concerns()
        if index == od.CONTROLWORD:
            self._execute(self.objects[od.CONTROLWORD])
        elif index == od.CONSUMER_HEARTBEAT:
            # Monitoring begins with the first heartbeat after this.
            self._host_heard_ns = None

    def _apply(self, data: bytes) -> None:
        entries = self.objects.mapped(od.RPDO_MAPPING)
        if len(data) < sum(entry.size for entry in entries):
            return
        at = 0
        for entry in entries:
            entry.decode(data[at : at + entry.size])
            at += entry.size
        self._execute(self.objects[od.CONTROLWORD])

    def _execute(self, controlword: int) -> None:
        before = self.machine.state
        self.machine.apply(controlword)
        if self.machine.state is PowerState.ENABLED and before is not PowerState.ENABLED:
            self._servo.engage()
        if before is PowerState.FAULT and self.machine.state is not PowerState.FAULT:
            self.emergency(0)
        self.objects[od.STATUSWORD] = self.machine.statusword

    def _sync(self) -> None:
        identifier = self.objects.sub(od.TPDO_SETTINGS, 1)
        if not identifier & od.PDO_INVALID:
            self._send(identifier, b"".join(entry.encode() for entry in self.objects.mapped(od.TPDO_MAPPING)))
        pending, self._pending = self._pending, None
        if pending is not None:
            self._apply(pending)
        if self.machine.state is PowerState.ENABLED:
            self._servo.retarget()

    def send_message(self, can_id: int, data: bytes) -> None:
        """Send a reply from the SDO server. The ``canopen`` library requires this name."""
        self._send(can_id, bytes(data))

    def _send(self, identifier: int, data: bytes) -> None:
        self._out.append(BusFrame(identifier, data))

    def _flush(self) -> list[BusFrame]:
        frames, self._out = self._out, []
        return self.outgoing(frames)
