"""``palpate examples``: what a wheel carries beside the code."""

import shutil
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from palpate.core.ports import Settings, new_folder

_HERE: Final = Path(__file__)
_PACKED: Final = _HERE.with_name("shipped")
"""Where a wheel has them (pyproject.toml, force-include); a checkout has them where they belong."""
_LEFT_OUT: Final = shutil.ignore_patterns("__pycache__", ".*")


@dataclass(frozen=True)
class CopyOptions(Settings):
    """Copy examples, rig files and the documents that speak of them into a new folder."""

    out: str = "palpate-examples"
    """The folder; it must be new or empty."""


def copy(options: CopyOptions) -> None:
    """Copy all of it, in the places in which the documents' links find it."""
    root = _PACKED if _PACKED.is_dir() else _HERE.parents[4]
    with new_folder(Path(options.out)) as folder:
        for name in ("examples", "rigs", "docs"):
            shutil.copytree(root / name, folder / name, ignore=_LEFT_OUT)
        for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "CITATION.cff", "LICENSE"):
            shutil.copy(root / name, folder)
    sys.stdout.write(f"examples, rigs and docs are in {options.out}; begin with {options.out}/docs/tutorial.md\n")
