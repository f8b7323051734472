"""The three upper layers in a row: measurement vector -> features -> symbol -> state (paper, Fig. 1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from palpate.core.errors import CommandError, ConfigurationError
from palpate.core.perception.channels import CHANNELS
from palpate.core.perception.features import FeatureExtractor
from palpate.core.perception.state import StateIdentifier
from palpate.core.perception.symbols import Symboliser


@dataclass(frozen=True)
class Perception:
    """What the arm makes of a filtered measurement vector.

    Attributes:
        extractor: Measurement vector to features.
        symboliser: Features to a symbol.
        identifier: Symbols to a state; the only one that may remember.

    Raises:
        ConfigurationError: A stage does not speak the language of the one before.
    """

    extractor: FeatureExtractor
    symboliser: Symboliser
    identifier: StateIdentifier

    def __post_init__(self) -> None:
        _require_same("perception.symboliser.features", self.symboliser.features, self.extractor.names)
        _require_same("perception.identifier.symbols", self.identifier.symbols, self.symboliser.symbols)

    @property
    def symbols(self) -> tuple[str, ...]:
        """Names of the symbols."""
        return self.symboliser.symbols

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states."""
        return self.identifier.states

    def reset(self) -> None:
        """A trial begins."""
        self.identifier.reset()

    def observe(self, signal: tuple[float, ...]) -> tuple[int, int]:
        """Symbol and state after one more measurement vector, in the order of ``CHANNELS``, SI units.

        Raises:
            CommandError: Not nine numbers, or one that is looked at is not finite.
        """
        if len(signal) != len(CHANNELS):
            raise CommandError(f"a measurement vector must have {len(CHANNELS)} channels", signal)
        symbol = self.symboliser.symbol(self.extractor.extract(signal))
        return symbol, self.identifier.update(symbol)

    def get_state(self) -> list[float]:
        """What the identifier remembers, for :meth:`set_state`."""
        return self.identifier.get_state()

    def set_state(self, state: Sequence[float]) -> None:
        """Go on from where :meth:`get_state` was called."""
        self.identifier.set_state(state)


def _require_same(field: str, asked: tuple[str, ...], given: tuple[str, ...]) -> None:
    if asked != given:
        raise ConfigurationError(field, asked, f"the names that the stage before gives: {', '.join(given)}")
