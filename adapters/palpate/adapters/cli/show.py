"""The ``palpate show`` command."""

import sys
from dataclasses import dataclass
from typing import Annotated

import tyro

from palpate.core.ports import Settings


@dataclass(frozen=True)
class ShowOptions(Settings):
    """Print the contents of a policy file: states, best actions, values and visits."""

    file: Annotated[str, tyro.conf.Positional]
    """Policy file."""


def show(options: ShowOptions) -> int:
    """Print the table in a policy file, and return the exit code."""
    from palpate.adapters.experiments import load_policy, render_table

    sys.stdout.write(render_table(load_policy(options.file)))
    return 0
