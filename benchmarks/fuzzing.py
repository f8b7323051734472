"""What the fuzzers share: a demand, a run that coverage guides, and a run of drawn cases."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

CORPORA = Path(__file__).parents[1] / "tests" / "fuzz"


def require(condition: bool, what: str) -> None:
    if not condition:
        raise AssertionError(what)


def parser_of(text: str | None) -> argparse.ArgumentParser:
    """A command line for this description, with how long to go on."""
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=int, default=600)
    return parser


def guided(
    parser: argparse.ArgumentParser,
    target: Callable[[Any, argparse.Namespace], tuple[Callable[[bytes], object], Path]],
    longest: int,
    *limits: str,
) -> None:
    """Fuzz as coverage leads, until the time is over.

    Needs atheris, which is no dependency of the project (``pip install atheris`` into any environment). New inputs go
    to the folder given by ``--corpus``, otherwise to one that is thrown away; the small corpus in tests/fuzz is only
    read. A failure ends the run with a traceback and leaves the input in a file named crash-*.

    Args:
        target: Lets atheris instrument what is to be covered; gives what runs an input, and its corpus.
        longest: Bytes of an input.
        limits: Further words for libFuzzer.
    """
    parser.add_argument("--corpus", type=Path, help="where new inputs go")
    arguments = parser.parse_args()
    import atheris  # type: ignore[import-not-found, unused-ignore]

    once, corpus = target(atheris, arguments)
    with tempfile.TemporaryDirectory() as scratch:
        folders = [str(arguments.corpus or Path(scratch)), str(corpus)]
        words = [f"-max_total_time={arguments.seconds}", f"-max_len={longest}", "-print_final_stats=1", *limits]
        atheris.Setup([sys.argv[0], *folders, *words], lambda data: once(data) and None)
        atheris.Fuzz()


def drawn(text: str | None, what: str, one: Callable[[int], object], seen: Counter[str]) -> None:
    """Cases by their seeds until the time is over; the first finding ends it, with its seed.

    Args:
        seen: What came of them is counted there.
    """
    parser = parser_of(text)
    parser.add_argument("--seed", type=int, default=0, help=f"of the first of the {what}; the others follow")
    arguments = parser.parse_args()
    seed, end_s = arguments.seed, time.monotonic() + arguments.seconds
    while time.monotonic() < end_s:
        try:
            one(seed)
        except BaseException:
            print(f"finding: --seed {seed}", flush=True)
            raise
        seed += 1
    print(f"{seed - arguments.seed} {what} in {arguments.seconds} s, no finding; {dict(seen)}")
