"""``palpate version``."""

import sys
from collections.abc import Sequence

from palpate.adapters.log import made_with
from palpate.core.errors import UsageError


def version(words: Sequence[str]) -> int:
    """Print the versions that results depend on; returns the exit code."""
    if words:
        raise UsageError(f"palpate version takes no {words[0]}")
    sys.stdout.write("".join(f"{name} {number}\n" for name, number in made_with().items()))
    return 0
