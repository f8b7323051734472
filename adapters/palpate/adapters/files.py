"""Write files and folders atomically: under a temporary name in the same folder, renamed when complete."""

import errno
import io
import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

from palpate.core.errors import ConfigurationError, OutputError

_UNREADABLE: Final = {errno.ENOENT: "no such file", errno.EISDIR: "no file, but a folder"}


def whole_text(path: str | Path, newline: str | None = None) -> io.TextIOWrapper:
    """Open a UTF-8 text file and skip a leading byte-order mark.

    Raises:
        OSError: The file cannot be read.
    """
    return io.TextIOWrapper(io.BytesIO(Path(path).read_bytes()), encoding="utf-8-sig", newline=newline)


def read_text(path: str | Path, field: str, accepted: str = "", newline: str | None = None) -> str:
    """Return the contents of a text file; the error lists the ``accepted`` values of the field, if given.

    Raises:
        ConfigurationError: The file cannot be read or is not UTF-8 text.
    """
    try:
        return whole_text(path, newline).read()
    except UnicodeDecodeError as error:
        raise ConfigurationError(field, str(path), f"no text in UTF-8 (from byte {error.start} on)") from error
    except OSError as error:
        problem = _UNREADABLE.get(error.errno or 0, f"no readable file ({error.strerror})")
        remedy = f"; accepted: {accepted}" if accepted else ""
        raise ConfigurationError(field, str(path), problem + remedy) from error


def json_of_file(path: str | Path) -> Any:
    """Return the contents of a JSON file.

    Raises:
        OSError: The file cannot be read.
        ValueError: The contents are not UTF-8 JSON.
    """
    text = whole_text(path).read()
    try:
        return json.loads(text)
    except RecursionError as error:
        raise ValueError("nested too deeply") from error


def require_no_file(path: Path, flag: str = "--out") -> None:
    """Before lengthy work, check that a file can be created without overwriting anything.

    Raises:
        OutputError: A file or folder with that name exists.
        OSError: Nothing can be written there.
    """
    _require_free(path, flag)
    passing = _passing_name(path)
    with _naming(path):
        passing.write_bytes(b"")
        passing.unlink()


def _require_free(path: Path, flag: str) -> None:
    # lexists, because a broken link must not be overwritten either.
    if os.path.lexists(path):
        raise OutputError(str(path), "exists and is never overwritten", f"name another file with {flag}")


def require_free_folder(path: Path) -> None:
    """Before lengthy work, check that a folder can be created, or exists and is empty.

    Raises:
        OutputError: A file or a non-empty folder with that name exists.
        OSError: Nothing can be written there.
    """
    _require_empty(path)
    with _passing_folder(path):
        """The folder can be created."""


def _require_empty(path: Path) -> None:
    if not os.path.lexists(path):
        return
    if os.path.islink(path) or not os.path.isdir(path):
        raise OutputError(str(path), "is no folder", "name another folder with --out")
    if os.listdir(path):
        raise OutputError(str(path), "holds something already", "name a new or an empty folder with --out")


def write_whole(path: Path, content: str | bytes, *, durable: bool = True) -> None:
    """Write or replace a file; an old file stays intact until the new one is complete.

    Args:
        content: The complete contents; text is written as UTF-8 with unchanged line endings.
        durable: True if the file must survive a power failure after this function returns, which takes milliseconds;
            otherwise, the old file may remain. A killed process never leaves a partial file.
    """
    with _renamed(path, durable=durable) as passing:
        passing.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)


@contextmanager
def new_file(path: Path, flag: str = "--out") -> Iterator[Path]:
    """Yield a temporary name for a file, which is renamed to ``path`` on success and removed on an error.

    Raises:
        OutputError: A file or folder with that name exists.
        OSError: The file cannot be written.
    """
    _require_free(path, flag)
    with _renamed(path) as passing:
        yield passing
        # Check again, because the file may have been created in the meantime.
        _require_free(path, flag)


@contextmanager
def _renamed(path: Path, *, durable: bool = True) -> Iterator[Path]:
    """Yield a temporary name next to ``path``; rename the result to ``path`` on success, and remove it on an error."""
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
    """Yield an empty folder, which is renamed to ``path`` on success and removed with its contents on an error.

    Missing parent folders are created, and removed again on an error.

    Raises:
        OutputError: A file or a non-empty folder with that name exists.
        OSError: The folder cannot be written.
    """
    _require_empty(path)
    with _passing_folder(path) as passing:
        yield passing
        _require_empty(path)
        os.replace(passing, path)


@contextmanager
def _passing_folder(path: Path) -> Iterator[Path]:
    """Yield an empty folder next to ``path``; on exit, remove it and any new parent folders that are empty."""
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
            # A folder that is no longer empty is kept.
            with suppress(OSError):
                parent.rmdir()


def _sync(path: Path) -> None:
    """Wait until a file, or a folder's list of entries, has been written to disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _passing_name(path: Path) -> Path:
    # Hidden, to avoid confusion with the result; the process ID prevents collisions between processes.
    return path.absolute().parent / f".{path.name}.{os.getpid()}.part"


def _remove(passing: Path) -> None:
    if os.path.isdir(passing):
        shutil.rmtree(passing, ignore_errors=True)
    elif os.path.lexists(passing):
        os.unlink(passing)


@contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Within the context, make OSErrors name ``path`` instead of the temporary file or folder."""
    try:
        yield
    except OSError as error:
        # Copying many files raises a list of errors without a single cause.
        raise OSError(error.errno, error.strerror or str(error)[:200], str(path)) from error
