"""State identification, which maps a trial's symbols to a state (paper, 3.4 and 5.3)."""

from abc import abstractmethod
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Annotated, ClassVar, Final, Protocol, runtime_checkable

from typing_extensions import override

from palpate.core.errors import CommandError, ConfigurationError
from palpate.core.perception.symbols import MOST_SYMBOLS
from palpate.core.ports import Names, Range, Settings, fitted

_TABLE: Final = "perception.identifier"


@runtime_checkable
class StateIdentifier(Protocol):
    """Interface for mapping symbols, one by one, to states, possibly with memory within a trial."""

    @property
    @abstractmethod
    def symbols(self) -> tuple[str, ...]:
        """Return the accepted symbol names, in order."""

    @property
    @abstractmethod
    def states(self) -> tuple[str, ...]:
        """Return readable state names; state ``i`` is ``states[i]``."""

    @abstractmethod
    def reset(self) -> None:
        """Clear the memory at the beginning of a trial."""

    @abstractmethod
    def update(self, symbol: int, action: str | None = None) -> int:
        """Return the state after another symbol.

        Args:
            action: Name of the preceding action; None at the start or if unknown.

        Raises:
            CommandError: The symbol does not exist.
        """

    @abstractmethod
    def get_state(self) -> list[float]:
        """Return the memory as plain numbers, for :meth:`set_state`."""

    @abstractmethod
    def set_state(self, state: Sequence[float]) -> None:
        """Restore the memory returned by :meth:`get_state`.

        Raises:
            ConfigurationError: The numbers are not a valid memory for this identifier.
        """


class _Memoryless(Settings):
    """Base class for identifiers without memory."""

    TABLE: ClassVar[str] = _TABLE

    def reset(self) -> None:
        """Do nothing, because there is no memory."""

    def get_state(self) -> list[float]:
        """Return an empty list, because there is no memory."""
        return []

    def set_state(self, state: Sequence[float]) -> None:
        """Accept only the empty memory."""
        if len(state):
            raise ConfigurationError("perception.identifier.state", state, "an empty list")


@dataclass(frozen=True)
class IdentityState(_Memoryless):
    """State identifier without memory that uses the last symbol as the state.

    Attributes:
        symbols: Symbol names, which are also the state names.

    Raises:
        ConfigurationError: A name is missing or repeated.
    """

    symbols: Names

    @property
    def states(self) -> tuple[str, ...]:
        """Return the symbol names."""
        return self.symbols

    def update(self, symbol: int, action: str | None = None) -> int:
        """Return the symbol itself, regardless of the action."""
        _require_symbol(symbol, len(self.symbols))
        return symbol


BETWEEN = " > "
"""Separator between symbols in a state name; the oldest symbol comes first."""


@dataclass(frozen=True)
class LastSymbols(Settings):
    """State identifier that uses the last few symbols, in order, as the state; fewer at the start of a trial.

    All combinations are states, shorter ones first, even if impossible, because states are numbered before any
    observation.

    Attributes:
        length: Number of remembered symbols, at least 1.

    Raises:
        ConfigurationError: A name is missing or repeated, or there are too many states to learn.
    """

    TABLE: ClassVar[str] = _TABLE

    symbols: Names
    length: Annotated[int, Range(1, 64)]

    @override
    def check(self) -> None:
        symbols = len(self.symbols)
        count = sum(symbols**size for size in range(1, self.length + 1))
        accepted = f"a number that gives at most {MOST_SYMBOLS} states; with {symbols} symbols there are {count}"
        self.require("length", count <= MOST_SYMBOLS, accepted)
        fitted(f"{_TABLE}.states", self.states, Names)

    @cached_property
    def states(self) -> tuple[str, ...]:
        """Return the state names, such as ``A > C``."""
        lengths = range(1, self.length + 1)
        return tuple(BETWEEN.join(word) for size in lengths for word in product(self.symbols, repeat=size))

    @cached_property
    def _recent(self) -> deque[int]:
        return deque(maxlen=self.length)

    def reset(self) -> None:
        """Clear the symbols."""
        self._recent.clear()

    def update(self, symbol: int, action: str | None = None) -> int:
        """Return the state after another symbol, regardless of the action.

        Raises:
            CommandError: The symbol does not exist.
        """
        count = len(self.symbols)
        _require_symbol(symbol, count)
        self._recent.append(symbol)
        # Counting from 1 in this base orders shorter words before longer ones.
        number = 0
        for recent in self._recent:
            number = number * count + recent + 1
        return number - 1

    def get_state(self) -> list[float]:
        """Return the remembered symbols, oldest first."""
        return [float(symbol) for symbol in self._recent]

    def set_state(self, state: Sequence[float]) -> None:
        """Set the remembered symbols.

        Raises:
            ConfigurationError: There are too many symbols, or one does not exist.
        """
        known = all(value in range(len(self.symbols)) for value in state)
        if len(state) > self.length or not known:
            accepted = f"at most {self.length} whole numbers from 0 to {len(self.symbols) - 1}"
            raise ConfigurationError("perception.identifier.state", tuple(state), accepted)
        self._recent.clear()
        self._recent.extend(int(value) for value in state)


AFTER: Final = " after "
_AT_FIRST: Final = "at first"


@dataclass(frozen=True)
class LastAction(_Memoryless):
    """State identifier that uses the last symbol and the kind of the preceding action (the first word of its name).

    Attributes:
        kinds: Action kinds.

    Raises:
        ConfigurationError: A name is missing or repeated, or there are too many states to learn.
    """

    symbols: Names
    kinds: Names

    @override
    def check(self) -> None:
        count = len(self.symbols) * (len(self.kinds) + 1)
        self.require("kinds", count <= MOST_SYMBOLS, f"so few that there are at most {MOST_SYMBOLS} states")
        fitted(f"{_TABLE}.states", self.states, Names)

    @cached_property
    def states(self) -> tuple[str, ...]:
        """Return the state names, such as ``A at first`` and ``A after push``."""
        states = [f"{symbol} {_AT_FIRST}" for symbol in self.symbols]
        return (*states, *(f"{symbol}{AFTER}{kind}" for kind in self.kinds for symbol in self.symbols))

    def update(self, symbol: int, action: str | None = None) -> int:
        """Return the state after a symbol and the action before it; an unknown kind counts as no action.

        Raises:
            CommandError: The symbol does not exist.
        """
        _require_symbol(symbol, len(self.symbols))
        kind = "" if action is None else action.partition(" ")[0]
        done = 1 + self.kinds.index(kind) if kind in self.kinds else 0
        return done * len(self.symbols) + symbol


def _require_symbol(symbol: int, count: int) -> None:
    if not 0 <= symbol < count:
        raise CommandError(f"a symbol must be from 0 to {count - 1}", symbol)
