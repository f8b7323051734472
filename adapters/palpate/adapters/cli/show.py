"""``palpate show``."""

import sys

from palpate.adapters.cli.options import ShowOptions
from palpate.adapters.experiments import render_table
from palpate.adapters.files import load_policy


def show(options: ShowOptions) -> int:
    """Print the table of a policy file; returns the exit code."""
    sys.stdout.write(render_table(load_policy(options.file)))
    return 0
