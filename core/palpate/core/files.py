"""Puts new files and folders in place whole: made under another name beside their place, renamed when complete."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from palpate.core.errors import OutputError


def require_no_file(path: Path, flag: str = "--out") -> None:
    """Make sure that a file can be made there without losing anything.

    Args:
        path: The file.
        flag: The option that names it, for the message.

    Raises:
        OutputError: Something of that name is there already.
    """
    # lexists, because a link that leads nowhere is in the way as well.
    if os.path.lexists(path):
        raise OutputError(str(path), "is there already and is never overwritten", f"name another file with {flag}")


def require_free_folder(path: Path) -> None:
    """Make sure that a folder can be made there, or is there and empty.

    Raises:
        OutputError: A file, or a folder that holds something, is there already.
    """
    if not os.path.lexists(path):
        return
    try:
        if os.path.islink(path) or not os.path.isdir(path):
            raise OutputError(str(path), "is no folder", "name another folder with --out")
        if os.listdir(path):
            raise OutputError(str(path), "holds something already", "name a new or an empty folder with --out")
    except OSError as error:
        raise OutputError(str(path), f"cannot be looked into ({error.strerror})", "name another folder") from error


@contextmanager
def new_file(path: Path, flag: str = "--out") -> Iterator[Path]:
    """Gives the name under which to write a file; on a good end it is renamed to ``path``, on a bad one removed.

    Args:
        path: The file.
        flag: The option that names it, for the message.

    Raises:
        OutputError: Something is there already, or it cannot be written there.
    """
    require_no_file(path, flag)
    passing = _passing_name(path)
    try:
        yield passing
        # Once more, because writing takes a while.
        require_no_file(path, flag)
        os.replace(passing, path)
    except OSError as error:
        raise _unwritable(path, error, f"file with {flag}") from error
    finally:
        _remove(passing)


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """Gives an empty folder to fill; on a good end it is renamed to ``path``, on a bad one it and its content go.

    Folders above ``path`` that are missing are made, and go again on a bad end.

    Raises:
        OutputError: A file or a folder that holds something is there already, or it cannot be written there.
    """
    require_free_folder(path)
    passing = _passing_name(path)
    made: list[Path] = []
    complete = False
    try:
        for parent in reversed([p for p in path.absolute().parents if not os.path.lexists(p)]):
            parent.mkdir()
            made.append(parent)
        passing.mkdir()
        yield passing
        require_free_folder(path)
        # Takes the place of an empty folder too.
        os.replace(passing, path)
        complete = True
    except OSError as error:
        raise _unwritable(path, error, "folder with --out") from error
    finally:
        _remove(passing)
        if not complete:
            for parent in reversed(made):
                # Not if somebody else has put something there meanwhile.
                with suppress(OSError):
                    parent.rmdir()


def _passing_name(path: Path) -> Path:
    # Hidden, so that nobody takes it for the result; with the process's number, so that two at once do not meet.
    return path.absolute().parent / f".{path.name}.{os.getpid()}.part"


def _remove(passing: Path) -> None:
    if os.path.isdir(passing):
        shutil.rmtree(passing, ignore_errors=True)
    elif os.path.lexists(passing):
        os.unlink(passing)


def _unwritable(path: Path, error: OSError, kind: str) -> OutputError:
    return OutputError(str(path), f"cannot be written ({error.strerror})", f"name another {kind}")
