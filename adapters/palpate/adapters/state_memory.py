"""What a learner remembers of the symbols before, as the configuration names it."""

from __future__ import annotations

import re
from typing import Final

from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState, LastSymbols, StateIdentifier

NONE: Final = "none"
_FIELD: Final = "perception.memory"
_ACCEPTED: Final = "none, or last-2, last-3 and so on"


def identifier(memory: str, symbols: tuple[str, ...]) -> StateIdentifier:
    """The state identification of that name, over these symbols.

    Args:
        memory: ``none``: the state is the last symbol; ``last-N``: the last N symbols in their order.
        symbols: Names of the symbols.

    Raises:
        ConfigurationError: No such memory, or one with more states than can be learned.
    """
    if memory == NONE:
        return IdentityState(symbols)
    last = re.fullmatch(r"last-([1-9][0-9]?)", memory)
    if last is None:
        raise ConfigurationError(_FIELD, memory, _ACCEPTED)
    try:
        return LastSymbols(symbols, int(last[1]))
    except ConfigurationError as error:
        raise ConfigurationError(_FIELD, memory, error.accepted) from error
