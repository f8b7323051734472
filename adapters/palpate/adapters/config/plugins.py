"""Third-party extensions, found by entry-point name or by ``package.module:Name``."""

import importlib
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from palpate.core.errors import ConfigurationError, describe


def entries(group: str) -> dict[str, EntryPoint]:
    """Return the entry points in a group by name."""
    return {entry.name: entry for entry in entry_points(group=group)}


@contextmanager
def from_here() -> Iterator[None]:
    """Make modules in the current folder importable within the context, as with ``python -m``."""
    before = list(sys.path)
    sys.path.insert(0, str(Path.cwd()))
    try:
        with folder_kept():
            yield
    finally:
        sys.path[:] = before


@contextmanager
def folder_kept() -> Iterator[None]:
    """Restore the working folder on exit, because third-party code may change it and result paths may be relative."""
    # Use its descriptor, because the folder may be moved in the meantime.
    here = os.open(".", os.O_PATH)
    try:
        yield
    finally:
        os.fchdir(here)
        os.close(here)


def imported(field: str, place: str, accepted: str) -> Any:
    """Return the object at ``package.module:Name``; the error for a malformed name contains ``accepted``.

    Raises:
        ConfigurationError: There is no such object.
    """
    module_name, colon, attribute = place.partition(":")
    if not colon or not module_name or not attribute:
        raise ConfigurationError(field, place, accepted)
    try:
        module = importlib.import_module(module_name)
    except ImportError as error:
        raise ConfigurationError(field, place, f"a module that can be imported ({describe(error)})") from error
    except (Exception, SystemExit, GeneratorExit) as error:
        # Importing a third-party module may raise any exception.
        raise ConfigurationError(field, place, f"a module that imports without failing ({describe(error)})") from error
    if not hasattr(module, attribute):
        raise ConfigurationError(field, place, f"a name in {module_name}; it has no {attribute}")
    return getattr(module, attribute)
