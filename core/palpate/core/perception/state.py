"""State identification: from the symbols of a trial so far to its state (paper, 3.4 and 5.3)."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from palpate.core.errors import CommandError, ConfigurationError
from palpate.core.perception.checks import names


@runtime_checkable
class StateIdentifier(Protocol):
    """Symbols in, one by one; states out. It may remember, within a trial."""

    @property
    @abstractmethod
    def symbols(self) -> tuple[str, ...]:
        """Names of the symbols it understands, in order."""

    @property
    @abstractmethod
    def states(self) -> tuple[str, ...]:
        """Readable names of the states; state ``i`` is ``states[i]``."""

    @property
    @abstractmethod
    def symbol_of(self) -> tuple[int | None, ...]:
        """For each state the last symbol, of several the usual one, (states,); None where there is none."""

    @abstractmethod
    def reset(self) -> None:
        """Forget: a trial begins."""

    @abstractmethod
    def update(self, symbol: int) -> int:
        """State after one more symbol.

        Raises:
            CommandError: No such symbol.
        """

    @abstractmethod
    def get_state(self) -> list[float]:
        """What it remembers, as plain numbers, for :meth:`set_state`."""

    @abstractmethod
    def set_state(self, state: Sequence[float]) -> None:
        """Go on from where :meth:`get_state` was called.

        Raises:
            ConfigurationError: Not a memory of this identifier.
        """


@dataclass(frozen=True)
class IdentityState:
    """The state is the last symbol: no memory.

    Attributes:
        symbols: Names of the symbols, which are the states too.

    Raises:
        ConfigurationError: No names, or one twice.
    """

    symbols: tuple[str, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "symbols", names("perception.identifier.symbols", self.symbols))

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states: those of the symbols."""
        return self.symbols

    @property
    def symbol_of(self) -> tuple[int, ...]:
        """The symbols themselves."""
        return tuple(range(len(self.symbols)))

    def reset(self) -> None:
        """Nothing to forget."""

    def update(self, symbol: int) -> int:
        """The symbol itself."""
        if not 0 <= symbol < len(self.symbols):
            raise CommandError(f"a symbol must be from 0 to {len(self.symbols) - 1}", symbol)
        return symbol

    def get_state(self) -> list[float]:
        """Nothing is remembered."""
        return []

    def set_state(self, state: Sequence[float]) -> None:
        """Accept only the empty memory."""
        if len(state):
            raise ConfigurationError("perception.identifier.state", state, "an empty list")
