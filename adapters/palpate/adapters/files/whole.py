"""Files and folders that are whole or not there: made under another name beside their place, renamed when complete."""

import io
import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from palpate.core.errors import ConfigurationError, OutputError


def whole_text(path: str | Path, newline: str | None = None) -> io.TextIOWrapper:
    """A text file in UTF-8, without the byte-order mark that it may begin with.

    Raises:
        OSError: It cannot be read.
    """
    return io.TextIOWrapper(io.BytesIO(Path(path).read_bytes()), encoding="utf-8-sig", newline=newline)


def read_text(path: Path, field: str, accepted: str = "a readable text file") -> str:
    """All of a text file.

    Raises:
        ConfigurationError: It cannot be read, or is not in UTF-8.
    """
    try:
        return whole_text(path).read()
    except UnicodeDecodeError as error:
        raise ConfigurationError(field, str(path), f"a text file in UTF-8; its byte {error.start} is not") from error
    except OSError as error:
        raise ConfigurationError(field, str(path), f"{accepted} ({error.strerror})") from error


def json_of_file(path: str | Path) -> Any:
    """What is in a JSON file, of any form.

    Raises:
        OSError: It cannot be read.
        ValueError: It is no JSON in UTF-8.
    """
    text = whole_text(path).read()
    try:
        return json.loads(text)
    except RecursionError as error:
        raise ValueError("nested too deeply") from error


def require_no_file(path: Path, flag: str = "--out") -> None:
    """Make sure that a file can be made there, without losing anything: before work that takes long.

    Raises:
        OutputError: Something of that name is there already.
        OSError: Nothing can be written there.
    """
    _require_free(path, flag)
    passing = _passing_name(path)
    with _naming(path):
        passing.write_bytes(b"")
        passing.unlink()


def _require_free(path: Path, flag: str) -> None:
    # lexists, because a link that leads nowhere is in the way as well.
    if os.path.lexists(path):
        raise OutputError(str(path), "is there already and is never overwritten", f"name another file with {flag}")


def require_free_folder(path: Path) -> None:
    """Make sure that a folder can be made there, or is there and empty: before work that takes long.

    Raises:
        OutputError: A file, or a folder that holds something, is there already.
        OSError: Nothing can be written there.
    """
    _require_empty(path)
    with _passing_folder(path):
        """It can be made."""


def _require_empty(path: Path) -> None:
    if not os.path.lexists(path):
        return
    if os.path.islink(path) or not os.path.isdir(path):
        raise OutputError(str(path), "is no folder", "name another folder with --out")
    if os.listdir(path):
        raise OutputError(str(path), "holds something already", "name a new or an empty folder with --out")


def write_whole(path: Path, content: str | bytes, *, durable: bool = True) -> None:
    """Write or replace a file; an old one stays intact until the new one is complete.

    Args:
        content: All of it; text is written as UTF-8 with the line ends that it has.
        durable: Whether it must outlast a power cut from the moment this returns. Waiting for the disk takes
            milliseconds; without it a power cut may leave the old file, but a killed process never leaves half of one.
    """
    with _renamed(path, durable=durable) as passing:
        passing.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)


@contextmanager
def new_file(path: Path, flag: str = "--out") -> Iterator[Path]:
    """Gives the name under which to write a file; on a good end it is renamed to ``path``, on a bad one removed.

    Raises:
        OutputError: Something is there already.
        OSError: It cannot be written there.
    """
    _require_free(path, flag)
    with _renamed(path) as passing:
        yield passing
        # Once more, because writing takes a while.
        _require_free(path, flag)


@contextmanager
def _renamed(path: Path, *, durable: bool = True) -> Iterator[Path]:
    """Gives another name next to ``path``; on a good end what is there is renamed, on a bad one removed."""
    passing = _passing_name(path)
    try:
        with _naming(path):
            yield passing
            if durable:
                _sync(passing)
            os.replace(passing, path)
            if durable:
                _sync(passing.parent)
    finally:
        with suppress(OSError):
            _remove(passing)


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """Gives an empty folder to fill; on a good end it is renamed to ``path``, on a bad one it and its content go.

    Folders above ``path`` that are missing are made, and go again on a bad end.

    Raises:
        OutputError: A file or a folder that holds something is there already.
        OSError: It cannot be written there.
    """
    _require_empty(path)
    with _passing_folder(path) as passing:
        yield passing
        _require_empty(path)
        os.replace(passing, path)


@contextmanager
def _passing_folder(path: Path) -> Iterator[Path]:
    """An empty folder beside ``path``; it goes at the end, and those above it that were missing and are empty."""
    passing = _passing_name(path)
    made: list[Path] = []
    try:
        with _naming(path):
            for parent in reversed([p for p in path.absolute().parents if not os.path.lexists(p)]):
                parent.mkdir()
                made.append(parent)
            passing.mkdir()
            yield passing
    finally:
        _remove(passing)
        for parent in reversed(made):
            # Not if something has been put there meanwhile.
            with suppress(OSError):
                parent.rmdir()


def _sync(path: Path) -> None:
    """Wait until a file, or the list of names in a folder, is on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _passing_name(path: Path) -> Path:
    # Hidden, so that nobody takes it for the result; with the process's number, so that two at once do not meet.
    return path.absolute().parent / f".{path.name}.{os.getpid()}.part"


def _remove(passing: Path) -> None:
    if os.path.isdir(passing):
        shutil.rmtree(passing, ignore_errors=True)
    elif os.path.lexists(passing):
        os.unlink(passing)


@contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Let an OSError name the file or folder itself, not the one that is made in its place."""
    try:
        yield
    except OSError as error:
        # Copying many files raises a list of errors, which has no one cause.
        raise OSError(error.errno, error.strerror or str(error)[:200], str(path)) from error
