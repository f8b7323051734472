"""Letters of strings in which one's own actions stand: first a symbol, then pairs of an action and what it led to.

A machine with inputs takes such letters where one without takes symbols. With S symbols, letter s is symbol s at the
start, and letter (1 + a) S + s is action a that led to symbol s. Without actions the symbols are the letters.
"""

from collections.abc import Sequence
from typing import Final

from palpate.core.errors import ConfigurationError

END: Final = "<end>"
"""What follows the last symbol of a string, among the symbols that may come next."""

BETWEEN: Final = ":"
"""Stands between action and symbol in the name of a pair."""


def letters_of(symbols: Sequence[str], actions: Sequence[str] = ()) -> tuple[str, ...]:
    """Names of the letters."""
    return (*symbols, *(f"{action}{BETWEEN}{symbol}" for action in actions for symbol in symbols))


def symbols_in(alphabet: Sequence[str], actions: Sequence[str], field: str) -> int:
    """How many symbols the letters are made of."""
    count = len(alphabet) // (len(actions) + 1)
    if tuple(alphabet) != letters_of(alphabet[:count], actions):
        accepted = f"the symbols, then each of them after each of the actions {', '.join(actions)}"
        raise ConfigurationError(field, tuple(alphabet), accepted)
    return count
