"""What lies between the loop and the arm's process: a socket for messages, and memory for what is newest."""

from __future__ import annotations

import mmap
import pickle
import select
import socket
import struct
import zlib
from contextlib import suppress
from typing import Any, Final, NamedTuple

from palpate.core.errors import DeviceError, PalpateError
from palpate.core.ports import Clock, JointSample

_LARGEST_BYTES: Final = 1 << 16
_HEAD: Final = struct.Struct("<QII")
"""Number of the note, length and checksum of what follows."""
_SLOT_BYTES: Final = 1 << 14
_PLAIN: Final = (str, int, float, tuple, list, type(None))


class Report(NamedTuple):
    """An error as it goes from process to process: kind, text and attributes stay as they are."""

    kind: type[PalpateError]
    text: str
    fields: dict[str, Any]

    @classmethod
    def of(cls, error: BaseException, device: str) -> Report:
        """The report of an error; of one that is not palpate's, a DeviceError with its text."""
        if not isinstance(error, PalpateError):
            error = DeviceError(device, f"its adapter failed: {error!r}")
        fields = {name: value if isinstance(value, _PLAIN) else repr(value) for name, value in vars(error).items()}
        return cls(type(error), str(error), fields)

    def error(self) -> PalpateError:
        """The error itself, to be raised here."""
        error = self.kind.__new__(self.kind, self.text)
        vars(error).update(self.fields)
        return error


class HostedStatus(NamedTuple):
    """How things stand at the arm; its process notes it every millisecond."""

    time_ns: int
    fault: str | None = None
    joints: JointSample | None = None
    trouble: Report | None = None
    account: str = ""


class Wire:
    """One end of a line of whole messages. Neither sending nor taking ever waits."""

    def __init__(self, end: socket.socket, clock: Clock) -> None:
        end.setblocking(False)
        self._end, self._clock = end, clock

    def put(self, message: object) -> bool:
        """Send; False where the far end has left too much lying, EOFError where nobody is there any more."""
        try:
            self._end.send(pickle.dumps(message))
        except BlockingIOError:
            return False
        except OSError as error:
            raise EOFError from error
        return True

    def take(self) -> Any:
        """The next message, None where there is none; EOFError where nobody is there to send one any more."""
        try:
            data = self._end.recv(_LARGEST_BYTES)
        except BlockingIOError:
            return None
        except OSError as error:
            raise EOFError from error
        if not data:
            raise EOFError
        return pickle.loads(data)

    def wait(self, until_ns: int) -> None:
        """Until a message is there, at most until that time of the run's clock."""
        left_ns = until_ns - self._clock.now_ns()
        with suppress(ValueError, OSError):
            # Closed meanwhile, by another thread: taking says so.
            select.select([self._end], [], [], max(left_ns, 0) * 1e-9)

    def close(self) -> None:
        """Close this end; the far one finds out."""
        self._end.close()


class Board:
    """Shared memory that one side writes and the other reads, always the newest note, never half of one."""

    BYTES: Final = 2 * _SLOT_BYTES

    def __init__(self, memory: mmap.mmap) -> None:
        self._memory, self._number = memory, 0
        self._read: HostedStatus | None = None

    def write(self, status: HostedStatus) -> None:
        """Put a note where the one before the last was."""
        data = pickle.dumps(status)
        if len(data) > _SLOT_BYTES - _HEAD.size:
            data = pickle.dumps(HostedStatus(status.time_ns, (status.fault or "")[:1000] or None))
        number = self._number = self._number + 1
        at = number % 2 * _SLOT_BYTES
        self._memory[at + _HEAD.size : at + _HEAD.size + len(data)] = data
        _HEAD.pack_into(self._memory, at, number, len(data), zlib.crc32(data, number))

    def read(self) -> HostedStatus | None:
        """The newest note; None while there is none."""
        newest = self._number
        for at in (0, _SLOT_BYTES):
            number, length, checksum = _HEAD.unpack_from(self._memory, at)
            if number > newest:
                data = self._memory[at + _HEAD.size : at + _HEAD.size + length]
                # One that is being written counts as not yet there.
                if zlib.crc32(data, number) == checksum:
                    newest, self._number, self._read = number, number, pickle.loads(data)
        return self._read
