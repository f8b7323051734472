"""Strings of symbols from random walks, and their files (paper, section 4).

A file has one string a line. Where every symbol is a single character they are written one after the other, as the
paper prints them (``CAAABBE``); otherwise with blanks between them (``wall gap wall``). A reader that is not told the
alphabet takes a file with a blank in any line for one of the second sort. Empty lines do not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final, TypeAlias

from palpate.core.checks import require_whole
from palpate.core.errors import ConfigurationError, OutputError
from palpate.core.perception import IdentityState
from palpate.core.policy import RandomWalkPolicy
from palpate.simulation.grid.maps import GridMap, grid_actions
from palpate.simulation.grid.trial import STEP_LIMIT, run_trial

String: TypeAlias = tuple[str, ...]
MOST: Final = 10_000_000


def walk_strings(grid: GridMap, count: int, seed: int, longest: int = STEP_LIMIT) -> tuple[String, ...]:
    """Readings of random walks that ended at the goal, the start's first; the goal itself has none.

    The walks are trials 0, 1, 2, ... of :func:`~palpate.simulation.grid.trial.run_trial` under a random policy; those
    that have not reached the goal after ``longest`` steps are left out, and the next trial takes their place.

    Args:
        grid: The map.
        count: How many strings.
        seed: Gives the walks.
        longest: Most symbols of a string, which is the most steps of a walk.

    Raises:
        ConfigurationError: A number is out of its range.
    """
    require_whole("grid.strings", count, 0, MOST)
    require_whole("grid.longest", longest, 1, MOST)
    identifier, policy = IdentityState(grid.symbols), RandomWalkPolicy(grid_actions())
    strings: list[String] = []
    trial = 0
    while len(strings) < count:
        walk = run_trial(grid, identifier, policy, seed, trial, step_limit=longest)
        trial += 1
        if walk.reached:
            strings.append(tuple(grid.symbols[symbol] for symbol in walk.symbols))
    return tuple(strings)


def strings_text(strings: Sequence[Sequence[str]]) -> str:
    """The text of a file of strings.

    Raises:
        ConfigurationError: A string is empty, or a symbol has a blank in its name.
    """
    for number, string in enumerate(strings):
        for symbol in string or ("",):
            if len(symbol.split()) != 1 or symbol.split()[0] != symbol:
                raise ConfigurationError(f"strings[{number}]", symbol, "symbols, at least one, without blanks in them")
    between = "" if all(len(symbol) == 1 for string in strings for symbol in string) else " "
    return "".join(between.join(string) + "\n" for string in strings)


def strings_in(text: str, alphabet: Sequence[str] | None = None) -> tuple[String, ...]:
    """What :func:`strings_text` wrote.

    Args:
        text: The text of a file.
        alphabet: The symbols that may occur; None takes whatever does.

    Raises:
        ConfigurationError: A symbol is not of the alphabet.
    """
    lines = [line.strip() for line in text.splitlines()]
    if alphabet is None:
        apart = any(len(line.split()) > 1 for line in lines)
    else:
        apart = any(len(symbol) > 1 for symbol in alphabet)
    strings = tuple(tuple(line.split()) if apart else tuple("".join(line.split())) for line in lines if line)
    for number, string in enumerate(strings):
        for symbol in string:
            if alphabet is not None and symbol not in alphabet:
                raise ConfigurationError(f"strings[{number}]", symbol, f"symbols of {', '.join(alphabet)}")
    return strings


def save_strings(strings: Sequence[Sequence[str]], path: str | Path) -> None:
    """Write a file of strings; one that is there already is left alone.

    Raises:
        ConfigurationError: See :func:`strings_text`.
        OutputError: The file is there already, or the place cannot be written.
    """
    text = strings_text(strings)
    try:
        with open(path, "x", encoding="utf-8", newline="\n") as stream:
            stream.write(text)
    except FileExistsError as error:
        raise OutputError(str(path), "is there already", "name another file") from error
    except OSError as error:
        raise OutputError(str(path), f"cannot be written ({error.strerror})", "name a writable place") from error


def load_strings(path: str | Path, alphabet: Sequence[str] | None = None) -> tuple[String, ...]:
    """Read a file of strings.

    Raises:
        ConfigurationError: It cannot be read; see :func:`strings_in` too.
    """
    try:
        return strings_in(Path(path).read_text(encoding="utf-8"), alphabet)
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError("strings.file", str(path), f"a readable file in UTF-8 ({error})") from error
