"""State identification: from the symbols of a trial so far to its state (paper, 3.4 and 5.3)."""

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
    """Symbols in, one by one; states out. It may have a memory, within a trial."""

    @property
    @abstractmethod
    def symbols(self) -> tuple[str, ...]:
        """Names of the symbols it takes, in order."""

    @property
    @abstractmethod
    def states(self) -> tuple[str, ...]:
        """Readable names of the states; state ``i`` is ``states[i]``."""

    @abstractmethod
    def reset(self) -> None:
        """A trial begins: clear the memory."""

    @abstractmethod
    def update(self, symbol: int, action: str | None = None) -> int:
        """State after one more symbol.

        Args:
            action: Name of the action that led to it; None at the start, and where it is not told.

        Raises:
            CommandError: No such symbol.
        """

    @abstractmethod
    def get_state(self) -> list[float]:
        """Its memory, as plain numbers, for :meth:`set_state`."""

    @abstractmethod
    def set_state(self, state: Sequence[float]) -> None:
        """Go on from where :meth:`get_state` was called.

        Raises:
            ConfigurationError: Not a memory of this identifier.
        """


class _Memoryless(Settings):
    """What an identifier has to say of a memory that it does not have."""

    TABLE: ClassVar[str] = _TABLE

    def reset(self) -> None:
        """There is no memory."""

    def get_state(self) -> list[float]:
        """There is no memory: an empty list."""
        return []

    def set_state(self, state: Sequence[float]) -> None:
        """Accept only the empty memory."""
        if len(state):
            raise ConfigurationError("perception.identifier.state", state, "an empty list")


@dataclass(frozen=True)
class IdentityState(_Memoryless):
    """The state is the last symbol: no memory.

    Attributes:
        symbols: Names of the symbols, which are the states too.

    Raises:
        ConfigurationError: No names, or one twice.
    """

    symbols: Names

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states: those of the symbols."""
        return self.symbols

    def update(self, symbol: int, action: str | None = None) -> int:
        """The symbol itself, whatever was done."""
        _require_symbol(symbol, len(self.symbols))
        return symbol


BETWEEN = " > "
"""Stands between the symbols in the name of a state, the older one first."""


@dataclass(frozen=True)
class LastSymbols(Settings):
    """The state is the last few symbols in their order; fewer of them while a trial is that young.

    All combinations are states, those of one symbol first, whether they can occur or not: states must have their
    numbers before anything was seen.

    Attributes:
        length: How many symbols are remembered, 1 or more.

    Raises:
        ConfigurationError: No names, one twice, or more states than could be learned.
    """

    TABLE: ClassVar[str] = _TABLE

    symbols: Names
    length: Annotated[int, Range(1, 64)]

    @override
    def check(self) -> None:
        symbols = len(self.symbols)
        count = sum(symbols**size for size in range(1, self.length + 1))
        accepted = f"one that makes at most {MOST_SYMBOLS} states; with {symbols} symbols there are {count}"
        self.require("length", count <= MOST_SYMBOLS, accepted)
        fitted(f"{_TABLE}.states", self.states, Names)

    @cached_property
    def states(self) -> tuple[str, ...]:
        """Names of the states, such as ``A > C``."""
        lengths = range(1, self.length + 1)
        return tuple(BETWEEN.join(word) for size in lengths for word in product(self.symbols, repeat=size))

    @cached_property
    def _recent(self) -> deque[int]:
        return deque(maxlen=self.length)

    def reset(self) -> None:
        """Clear the symbols."""
        self._recent.clear()

    def update(self, symbol: int, action: str | None = None) -> int:
        """State after one more symbol, whatever was done.

        Raises:
            CommandError: No such symbol.
        """
        count = len(self.symbols)
        _require_symbol(symbol, count)
        self._recent.append(symbol)
        # Counting from 1 in this base puts shorter words before longer ones.
        number = 0
        for recent in self._recent:
            number = number * count + recent + 1
        return number - 1

    def get_state(self) -> list[float]:
        """The symbols that are remembered, the oldest first."""
        return [float(symbol) for symbol in self._recent]

    def set_state(self, state: Sequence[float]) -> None:
        """Take these symbols as its memory.

        Raises:
            ConfigurationError: Too many of them, or something that is no symbol.
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
    """The state is the last symbol and what was done before it: an action's kind, which is the first word of its name.

    Attributes:
        kinds: Kinds of the actions.

    Raises:
        ConfigurationError: No names, one twice, or more states than could be learned.
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
        """Names of the states, such as ``A at first`` and ``A after push``."""
        states = [f"{symbol} {_AT_FIRST}" for symbol in self.symbols]
        return (*states, *(f"{symbol}{AFTER}{kind}" for kind in self.kinds for symbol in self.symbols))

    def update(self, symbol: int, action: str | None = None) -> int:
        """The symbol after an action of that kind; one of no known kind counts as none.

        Raises:
            CommandError: No such symbol.
        """
        _require_symbol(symbol, len(self.symbols))
        kind = "" if action is None else action.partition(" ")[0]
        done = 1 + self.kinds.index(kind) if kind in self.kinds else 0
        return done * len(self.symbols) + symbol


def _require_symbol(symbol: int, count: int) -> None:
    if not 0 <= symbol < count:
        raise CommandError(f"a symbol must be from 0 to {count - 1}", symbol)
