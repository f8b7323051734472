"""A JR3 node on a CAN bus. A frame's 11-bit identifier is the operation plus the node number."""

import struct
from collections import deque
from enum import IntEnum

from palpate.simulation.emulators.jr3.node import BOOT_NS, Jr3Node, Notice, Sample, WrenchSource, unsigned
from palpate.simulation.emulators.lines import BusFrame

POLL_ns = 1_000_000
"""Time between checks for commands in the main loop. FACT: jr3-mbed-firmware-can main.cpp."""

_QUEUE_FRAMES = 32
_NODE_BITS = 0x7F


class CanOperation(IntEnum):
    """Base identifiers, to which the node number is added. FACT: jr3-mbed-firmware-can main.cpp."""

    ACK = 0x100
    START_ASYNC = 0x200
    STOP = 0x280
    GET_STATE = 0x400
    GET_FULL_SCALE_FORCES = 0x480
    GET_FULL_SCALE_MOMENTS = 0x500
    FORCES = 0x600
    MOMENTS = 0x680
    BOOTUP = 0x700


class Jr3CanNode:
    """A `CanNode` with the firmware functions that a streaming host needs. SYNC, RESET and ZERO are not emulated.

    Commands wait in a queue of 32, which the main loop reads every millisecond. Therefore `feed` never returns the
    acknowledgement for the command that it receives, which follows within a millisecond. A full queue drops the oldest
    command (INFERENCE: circular buffer of Mbed OS).

    Raises:
        ValueError: The node number is not between 1 and 127.
    """

    def __init__(self, node_id: int, wrench: WrenchSource, boot_ns: int = BOOT_NS) -> None:
        if not 1 <= node_id <= _NODE_BITS:
            raise ValueError(f"node_id: 1 to 127 expected, got {node_id}")
        self.node_id = node_id
        self.firmware = Jr3Node(wrench, boot_ns)
        self._commands: deque[tuple[int, bytes]] = deque(maxlen=_QUEUE_FRAMES)
        self._next_poll_ns: int | None = None

    def feed(self, arbitration_id: int, data: bytes, now_ns: int) -> list[BusFrame]:
        """Receive a frame from the bus. A frame with this node's number is queued."""
        frames = self.advance(now_ns)
        if self.firmware.serving and arbitration_id & _NODE_BITS == self.node_id:
            self._commands.append((arbitration_id & ~_NODE_BITS, data))
        return frames

    def advance(self, now_ns: int) -> list[BusFrame]:
        """Advance the time and return the frames that the node has sent in that time."""
        if self._next_poll_ns is None:
            self._next_poll_ns = now_ns + POLL_ns
        frames: list[BusFrame] = []
        while self._next_poll_ns <= now_ns:
            if not self._commands:
                # Passes of the loop without commands have no effect.
                self._next_poll_ns += ((now_ns - self._next_poll_ns) // POLL_ns + 1) * POLL_ns
                break
            frames += self._run_until(self._next_poll_ns)
            frames += self._serve(self._next_poll_ns)
            self._next_poll_ns += POLL_ns
        frames += self._run_until(now_ns)
        return [] if self.firmware.silent else frames

    def reboot(self, now_ns: int) -> None:
        """Interrupt the power. The node sends BOOTUP after the boot time."""
        self._commands.clear()
        self.firmware.reboot(now_ns)

    def _run_until(self, now_ns: int) -> list[BusFrame]:
        frames: list[BusFrame] = []
        for event in self.firmware.advance(now_ns):
            if event is Notice.BOOTED:
                frames.append(self._frame(CanOperation.BOOTUP))
            elif isinstance(event, Sample):
                loads = {CanOperation.FORCES: event.counts[:3], CanOperation.MOMENTS: event.counts[3:]}
                frames += (self._frame(kind, struct.pack("<3hH", *load, event.counter)) for kind, load in loads.items())
        return frames

    def _serve(self, now_ns: int) -> list[BusFrame]:
        frames: list[BusFrame] = []
        while self._commands:
            frames += self._execute(*self._commands.popleft(), now_ns)
        return frames

    def _execute(self, operation: int, data: bytes, now_ns: int) -> list[BusFrame]:
        match operation:
            case CanOperation.START_ASYNC:
                self.firmware.start(unsigned(data, 0, 2), now_ns, period_us=unsigned(data, 2, 4))
            case CanOperation.STOP:
                self.firmware.stop()
            case CanOperation.GET_STATE:
                pass
            case CanOperation.GET_FULL_SCALE_FORCES:
                return [self._acknowledgement(*self.firmware.full_scale_words()[:3])]
            case CanOperation.GET_FULL_SCALE_MOMENTS:
                return [self._acknowledgement(*self.firmware.full_scale_words()[3:])]
            case _:
                return []
        return [self._acknowledgement()]

    def _acknowledgement(self, *words: int) -> BusFrame:
        return self._frame(CanOperation.ACK, struct.pack(f"<B{len(words)}H", self.firmware.state, *words))

    def _frame(self, operation: CanOperation, data: bytes = b"") -> BusFrame:
        return BusFrame(operation + self.node_id, data)
