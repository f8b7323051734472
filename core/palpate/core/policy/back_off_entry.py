"""The part of a policy file that says what a learner backs off to; the q of the table follow from it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Self, TypeVar

from palpate.core.errors import ConfigurationError, PolicyFileError
from palpate.core.policy.back_off import BackOff
from palpate.core.policy.parsing import read_count, read_list, read_number, read_object

Number = TypeVar("Number", int, float)

_WHERE: Final = "learner.back_off"
_KEYS: Final = ("visits", "symbol_of", "state_q", "symbol_q", "symbol_visits")


@dataclass(frozen=True, slots=True)
class BackOffEntry:
    """What states and symbols have learned, each for itself.

    Attributes:
        settings: From states to symbols.
        state_q: The states' own Q, (states, actions).
        symbol_q: Q of the symbols, (symbols, actions).
        symbol_visits: How often each action was learned from under each symbol, (symbols, actions).
    """

    settings: BackOff
    state_q: tuple[tuple[float, ...], ...]
    symbol_q: tuple[tuple[float, ...], ...]
    symbol_visits: tuple[tuple[int, ...], ...]

    def values(self) -> dict[str, Any]:
        """What was learned, by the names and in the shapes that the state of a learner has."""
        tables = {"q": self.state_q, "symbol_q": self.symbol_q, "symbol_visits": self.symbol_visits}
        return {name: [list(row) for row in rows] for name, rows in tables.items()}

    def content(self) -> dict[str, Any]:
        """The entry as JSON has it."""
        settings = {"visits": self.settings.visits, "symbol_of": self.settings.symbol_of}
        return settings | {key: getattr(self, key) for key in _KEYS[2:]}

    def blank(self, initial_value: float) -> Self:
        """The same before anything was learned."""

        def unlearned(rows: Sequence[Sequence[float]]) -> tuple[tuple[float, ...], ...]:
            return tuple((initial_value,) * len(row) for row in rows)

        visits = tuple((0,) * len(row) for row in self.symbol_visits)
        states, symbols = unlearned(self.state_q), unlearned(self.symbol_q)
        return replace(self, state_q=states, symbol_q=symbols, symbol_visits=visits)

    @classmethod
    def read(cls, raw: object) -> Self:
        """Read it from JSON.

        Raises:
            PolicyFileError: It is no such entry.
        """
        entry = read_object(_WHERE, raw, _KEYS)
        symbol_of = tuple(
            None if symbol is None else read_count(f"{_WHERE}.symbol_of[{n}]", symbol)
            for n, symbol in enumerate(read_list(f"{_WHERE}.symbol_of", entry["symbol_of"]))
        )
        try:
            settings = BackOff(read_number(f"{_WHERE}.visits", entry["visits"]), symbol_of)
        except ConfigurationError as error:
            raise PolicyFileError(error.field.replace("policy.", "learner.", 1), error.value, error.accepted) from error
        return cls(
            settings,
            state_q=_table("state_q", entry["state_q"], read_number),
            symbol_q=_table("symbol_q", entry["symbol_q"], read_number),
            symbol_visits=_table("symbol_visits", entry["symbol_visits"], read_count),
        )

    def check_table(self, q: Sequence[Sequence[float]], visits: Sequence[Sequence[int]]) -> None:
        """Refuse a table that does not follow from this.

        Args:
            q: Q of each state and action in the table, (states, actions).
            visits: How often each was learned from, (states, actions).

        Raises:
            PolicyFileError: Sizes that do not fit, or a q that is another.
        """
        actions = len(q[0])
        symbols = self.settings.symbols
        sizes = {"state_q": len(q), "symbol_q": symbols, "symbol_visits": symbols}
        for key, count in sizes.items():
            rows: Sequence[Sequence[float]] = getattr(self, key)
            if [len(row) for row in rows] != [actions] * count:
                raise PolicyFileError(f"{_WHERE}.{key}", f"{len(rows)} rows", f"{count} rows of {actions} numbers")
        if len(self.settings.symbol_of) != len(q):
            raise PolicyFileError(f"{_WHERE}.symbol_of", len(self.settings.symbol_of), f"{len(q)}, one a state")
        for state, row in enumerate(q):
            follows = tuple(self.settings.values(state, visits[state], self.state_q[state], self.symbol_q))
            if tuple(row) != follows:
                raise PolicyFileError(f"table[{state}].q", tuple(row), f"{follows}, as follows from {_WHERE}")


def _table(key: str, raw: object, read: Callable[[str, object], Number]) -> tuple[tuple[Number, ...], ...]:
    """Rows of numbers, of whatever lengths."""
    where = f"{_WHERE}.{key}"
    rows = [read_list(f"{where}[{n}]", row) for n, row in enumerate(read_list(where, raw))]
    return tuple(tuple(read(f"{where}[{n}]", value) for value in row) for n, row in enumerate(rows))
