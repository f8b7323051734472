"""Common parts of the fuzzers: corpora, requirements, and a run of cases generated from seeds."""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Final

CORPORA: Final = Path(__file__).parents[1] / "tests" / "fuzz"


def require(condition: object, what: str) -> None:
    if not condition:
        raise AssertionError(what)


def drawn(text: str | None, what: str, one: Callable[[int], object], seen: Counter[str]) -> None:
    """Run cases with consecutive seeds until the time is over. The first finding ends the run and prints its seed.

    Args:
        seen: Counter of the results.
    """
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=int, default=600)
    parser.add_argument("--first-seed", type=int, default=0, help=f"of the first of the {what}; the others follow")
    options = parser.parse_args()
    seed, end_s = options.first_seed, time.monotonic() + options.seconds
    while time.monotonic() < end_s:
        try:
            one(seed)
        except BaseException:
            print(f"finding: --first-seed {seed}", flush=True)
            raise
        seed += 1
    print(f"{seed - options.first_seed} {what} in {options.seconds} s, no finding; {dict(seen)}")
