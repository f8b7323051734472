"""A rig's fault latch, kept in a file next to the rig file to outlast the program. Only a person can clear it."""

from __future__ import annotations

import json
import re
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import ClassVar, Final

from typing_extensions import override

from palpate.adapters.files import json_of_file, write_whole
from palpate.core.errors import ConfigurationError, DeviceError, OutputError, one_line
from palpate.core.ports import Acknowledgement, FaultLatch, Settings

FORMAT: Final = 1
_WORDS: Final = re.compile(r"\s*(\d+)\s+([^:]*\S)\s*:\s*(\S|\S.*\S)\s*", re.DOTALL)
_NAME, _WHY = "NAME", "why"
"""Placeholders in the option that messages suggest."""


@dataclass(frozen=True)
class Fault(Settings):
    """A trip or a device fault. In a file, all but the latest are acknowledged and have a non-empty ``by``."""

    TABLE: ClassVar[str] = "fault"

    number: int
    cause: str
    time: str
    by: str = ""
    reason: str = ""
    acknowledged: str = ""


@dataclass(frozen=True)
class _Document(Settings):
    format: int = FORMAT
    faults: tuple[Fault, ...] = ()


class FaultFile(FaultLatch):
    """Fault latch for one rig. A separate thread writes it at each trip, because the disk may be slow.

    Args:
        rig_file: Rig file next to which the latch is stored; None keeps the latch in memory only.
        words: Acknowledgement of the open fault, ``NUMBER NAME: why``; consumed by :meth:`begin`.

    Raises:
        OutputError: The file cannot be read.
        FaultLatchedError: A fault is open and not acknowledged.
        ConfigurationError: The acknowledgement names no fault, or the wrong one.
    """

    def __init__(self, rig_file: Path | None, words: str = "") -> None:
        super().__init__()
        self.still: Callable[[], str] = str
        path = None if rig_file is None else rig_file.resolve()
        self._path = None if path is None else path.with_name(f"{path.name}.fault.json")
        self._faults = tuple[Fault, ...]()
        self._writer = threading.Thread()
        self._load()
        self._given = self._parsed(words) if words else None
        if self._given is None:
            self.require_free()

    @property
    def number(self) -> int:
        """Number of the latest fault, or 0 before the first."""
        return self._faults[-1].number if self._faults else 0

    @property
    @override
    def remedy(self) -> str:
        return f'acknowledge it: --acknowledge "{self.number} {_NAME}: {_WHY}"'

    def begin(self) -> None:
        """Apply the acknowledgement before the first motion, once all devices are open.

        Raises:
            FaultLatchedError: A fault is open; another program may have latched it.
            DeviceError: A device still reports a fault.
            OutputError, OSError: The file cannot be read or written. Nothing moves, because a new fault would be lost.
        """
        self._load()
        if self._given is not None:
            given, self._given = self._given, None
            self.acknowledge(given.by, given.reason)
            sys.stderr.write(f"palpate: fault {self.number} is acknowledged by {given.by}: {given.reason}\n")
        self.require_free()
        self._write()

    @override
    def set(self, cause: str) -> None:
        if self.cause:
            return
        super().set(one_line(cause))
        self._faults = (*self._faults, Fault(self.number + 1, self.cause, _now()))
        self._writer = threading.Thread(target=self._write_if_possible, name="fault file")
        self._writer.start()

    @override
    def acknowledge(self, by: str, reason: str) -> None:
        self._wait()
        if present := self.still():
            raise DeviceError(
                "rig", f"{present}, still; fault {self.number} cannot be acknowledged before that is over"
            )
        before, cause = self._faults, self.cause
        super().acknowledge(by, reason)
        self._faults = (*before[:-1], replace(before[-1], by=by, reason=reason, acknowledged=_now()))
        try:
            self._write()
        except OSError:
            # An acknowledgement counts only once it is on the disk.
            self.acknowledgements.pop()
            self._faults, self.cause = before, cause
            raise

    def end(self) -> None:
        """Wait until a new fault is stored on disk, and print how to acknowledge it."""
        self._wait()
        if self.cause and self._path is not None:
            problem = self._write_if_possible()
            place = f"not kept: {problem}" if problem else f"kept in {self._path}"
            with suppress(OSError):
                sys.stderr.write(f"palpate: fault {self.number}: {self.cause}; {place}; {self.remedy}\n")

    def _parsed(self, words: str) -> Acknowledgement:
        found, last = _WORDS.fullmatch(words), self._faults[-1] if self._faults else None
        accepted = f"the open fault, {self.number} ({self.cause})"
        if not self.cause:
            done = f"; {last.by} acknowledged fault {last.number} at {last.acknowledged}" if last is not None else ""
            accepted = f"left out: no fault is open{done}"
        elif found is None or found[2] == _NAME or found[3] == _WHY:
            accepted = f'"{self.number} {_NAME}: {_WHY}", with your name and the reason'
        elif int(found[1]) == self.number:
            return Acknowledgement(found[2], found[3], self.cause)
        raise ConfigurationError("acknowledge", words, accepted)

    def _load(self) -> None:
        if self._path is None:
            return
        try:
            found = _Document.read(json_of_file(self._path), "fault file") if self._path.exists() else _Document()
            if found.format != FORMAT:
                raise ValueError(f"format {found.format}, not {FORMAT}")
        except (OSError, ValueError) as error:
            remedy = "repair it; without its faults the rig does not move"
            raise OutputError(str(self._path), f"cannot be read ({error})", remedy) from error
        self._faults = found.faults
        self.cause = self._faults[-1].cause if self._faults and not self._faults[-1].by else ""

    def _write(self) -> None:
        if self._path is not None:
            content = _Document(FORMAT, self._faults)
            write_whole(self._path, json.dumps(asdict(content), indent=1, ensure_ascii=False) + "\n")

    def _write_if_possible(self) -> str:
        """Write the faults and return an empty string, or the reason why they cannot be written."""
        try:
            self._write()
        except OSError as error:
            return str(error.strerror)
        return ""

    def _wait(self) -> None:
        if self._writer.ident is not None:
            self._writer.join()


def _now() -> str:
    return datetime.now().astimezone().isoformat(timespec="seconds")
