"""What others bring: found by the name of an entry point, or by ``package.module:Name``."""

import importlib
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from palpate.core.errors import ConfigurationError, told


def entries(group: str) -> dict[str, EntryPoint]:
    """The entry points of a group, by their names."""
    return {entry.name: entry for entry in entry_points(group=group)}


@contextmanager
def from_here() -> Iterator[None]:
    """While inside, what lies in the current folder can be imported, as with ``python -m``."""
    before = list(sys.path)
    sys.path.insert(0, str(Path.cwd()))
    try:
        with folder_kept():
            yield
    finally:
        sys.path[:] = before


@contextmanager
def folder_kept() -> Iterator[None]:
    """Put the working folder back: third-party code may change it, and result paths may be relative to it."""
    # By its number: it may have been moved meanwhile.
    here = os.open(".", os.O_PATH)
    try:
        yield
    finally:
        os.fchdir(here)
        os.close(here)


def imported(field: str, place: str, accepted: str) -> Any:
    """What ``package.module:Name`` leads to.

    Args:
        accepted: What would be right, for a name of another form.

    Raises:
        ConfigurationError: It leads to nothing.
    """
    module_name, colon, attribute = place.partition(":")
    if not colon or not module_name or not attribute:
        raise ConfigurationError(field, place, accepted)
    try:
        module = importlib.import_module(module_name)
    except ImportError as error:
        raise ConfigurationError(field, place, f"a module that can be imported ({error})") from error
    except (Exception, SystemExit, GeneratorExit) as error:
        # Whatever a third-party module does as it is imported.
        raise ConfigurationError(field, place, f"a module that imports without failing ({told(error)})") from error
    if not hasattr(module, attribute):
        raise ConfigurationError(field, place, f"a name in {module_name}; it has no {attribute}")
    return getattr(module, attribute)
