"""Memory shared by the loop and the arm process. Set-points go to the arm; joint samples and faults come back."""

import mmap
import pickle
import struct
import zlib
from typing import Any, Final, Generic, NamedTuple, TypeVar

from palpate.core.ports import AppliedCommand, JointSample, JointVector

_HEAD: Final = struct.Struct("<QII")
"""Number, length and checksum of the following note."""
_SLOT_BYTES: Final = 1 << 14
_WORDS_BYTES: Final = 64
NoteT = TypeVar("NoteT")


class Setpoint(NamedTuple):
    """A set-point and the time at which the loop sent it."""

    number: int
    sent_ns: int
    position_rad: JointVector


class ArmStatus(NamedTuple):
    """Arm state.

    Attributes:
        applied: Command applied for the latest accepted set-point.
        taken: Number of that set-point.
    """

    fault: str | None = None
    joints: JointSample | None = None
    applied: AppliedCommand | None = None
    taken: int = 0


class SharedState(Generic[NoteT]):
    """Memory in which one side writes notes that the other reads. A reader always gets the latest complete note."""

    BYTES: Final = 2 * _SLOT_BYTES

    def __init__(self, memory: mmap.mmap, offset: int, empty: NoteT) -> None:
        self._memory, self._offset, self._number = memory, offset, 0
        self._read: NoteT = empty

    def write(self, note: NoteT) -> None:
        """Write a note to the older of the two slots."""
        data = pickle.dumps(note)
        number = self._number = self._number + 1
        at = self._offset + number % 2 * _SLOT_BYTES
        self._memory[at + _HEAD.size : at + _HEAD.size + len(data)] = data
        _HEAD.pack_into(self._memory, at, number, len(data), zlib.crc32(data, number))

    def read(self) -> NoteT:
        """Return the latest note, or an empty note if there is none."""
        newest = self._number
        for at in (self._offset, self._offset + _SLOT_BYTES):
            number, length, checksum = _HEAD.unpack_from(self._memory, at)
            if number > newest:
                data = self._memory[at + _HEAD.size : at + _HEAD.size + length]
                # A note that is being written counts as absent.
                if zlib.crc32(data, number) == checksum:
                    note: Any = pickle.loads(data)
                    newest, self._number, self._read = number, number, note
        return self._read


class _Word:
    """A time in ns that the processor reads and writes atomically; ``struct`` would write a 0 first."""

    def __init__(self, index: int) -> None:
        self._index = index

    def __get__(self, memory: "ArmMemory", kind: type) -> int:
        return memory.words[self._index]

    def __set__(self, memory: "ArmMemory", time_ns: int) -> None:
        memory.words[self._index] = time_ns


class ArmMemory:
    """All data shared by the two processes.

    Attributes:
        stop_requested_ns: Time of the last stop request, from any thread or signal handler of the loop's process.
    """

    BYTES: Final = _WORDS_BYTES + 2 * SharedState.BYTES
    stop_requested_ns = _Word(0)
    stopped_ns = _Word(1)
    heartbeat_ns = _Word(2)

    def __init__(self, memory: mmap.mmap) -> None:
        self.words = memoryview(memory)[:_WORDS_BYTES].cast("q")
        self.setpoint = SharedState[Setpoint | None](memory, _WORDS_BYTES, None)
        self.status = SharedState[ArmStatus](memory, _WORDS_BYTES + SharedState.BYTES, ArmStatus())
