"""Memory that loop and arm process share: set-points one way, joints and faults the other. Neither side waits."""

import mmap
import pickle
import struct
import zlib
from typing import Any, Final, Generic, NamedTuple, TypeVar

from palpate.core.ports import AppliedCommand, JointSample, JointVector

_HEAD: Final = struct.Struct("<QII")
"""Number of the note, length and checksum of what follows."""
_SLOT_BYTES: Final = 1 << 14
_WORDS_BYTES: Final = 64
NoteT = TypeVar("NoteT")


class Setpoint(NamedTuple):
    """What the arm is to go to, and when the loop said so."""

    number: int
    sent_ns: int
    position_rad: JointVector


class ArmStatus(NamedTuple):
    """How things stand at the arm.

    Attributes:
        applied: What became of the newest set-point that was taken.
        taken: Number of that one.
    """

    fault: str | None = None
    joints: JointSample | None = None
    applied: AppliedCommand | None = None
    taken: int = 0


class Board(Generic[NoteT]):
    """One side writes, the other reads: always the newest note, never half of one."""

    BYTES: Final = 2 * _SLOT_BYTES

    def __init__(self, memory: mmap.mmap, offset: int, empty: NoteT) -> None:
        self._memory, self._offset, self._number = memory, offset, 0
        self._read: NoteT = empty

    def write(self, note: NoteT) -> None:
        """Put a note where the one before the last was."""
        data = pickle.dumps(note)
        number = self._number = self._number + 1
        at = self._offset + number % 2 * _SLOT_BYTES
        self._memory[at + _HEAD.size : at + _HEAD.size + len(data)] = data
        _HEAD.pack_into(self._memory, at, number, len(data), zlib.crc32(data, number))

    def read(self) -> NoteT:
        """The newest note; the empty one while there is none."""
        newest = self._number
        for at in (self._offset, self._offset + _SLOT_BYTES):
            number, length, checksum = _HEAD.unpack_from(self._memory, at)
            if number > newest:
                data = self._memory[at + _HEAD.size : at + _HEAD.size + length]
                # One that is being written counts as not yet there.
                if zlib.crc32(data, number) == checksum:
                    note: Any = pickle.loads(data)
                    newest, self._number, self._read = number, number, note
        return self._read


class _Word:
    """A time, ns. Reading and writing are one step each of the processor: ``struct`` would put a 0 there in between."""

    def __init__(self, index: int) -> None:
        self._index = index

    def __get__(self, memory: "ArmMemory", kind: type) -> int:
        return memory.words[self._index]

    def __set__(self, memory: "ArmMemory", time_ns: int) -> None:
        memory.words[self._index] = time_ns


class ArmMemory:
    """All that is shared.

    Attributes:
        stop_asked_ns: When the arm was last asked to stop; written by any thread of the loop's process, and by signal
            handlers.
        stopped_ns: When it was last told to stop because of that.
        beat_ns: When the arm's process last looked.
    """

    BYTES: Final = _WORDS_BYTES + 2 * Board.BYTES
    stop_asked_ns = _Word(0)
    stopped_ns = _Word(1)
    beat_ns = _Word(2)

    def __init__(self, memory: mmap.mmap) -> None:
        self.words = memoryview(memory)[:_WORDS_BYTES].cast("q")
        self.setpoint = Board[Setpoint | None](memory, _WORDS_BYTES, None)
        self.status = Board[ArmStatus](memory, _WORDS_BYTES + Board.BYTES, ArmStatus())
