"""``palpate show``."""

from __future__ import annotations

import sys
from pathlib import Path

from palpate.adapters.cli.options import ShowOptions
from palpate.core.policy import PolicyDocument, render_table


def show(options: ShowOptions) -> int:
    """Print the table of a policy file; returns the exit code."""
    sys.stdout.write(render_table(PolicyDocument.load(Path(options.file))) + "\n")
    return 0
