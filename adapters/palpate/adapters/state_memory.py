"""What a learner remembers of the symbols before, as the configuration names it."""

from __future__ import annotations

import re
from typing import Final

from palpate.core.automata.document import load
from palpate.core.automata.tracker import AutomatonState
from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState, LastSymbols, StateIdentifier

NONE: Final = "none"
_FIELD: Final = "perception.memory"
_ACCEPTED: Final = "none, last-2, last-3 and so on, or an automaton file ending in .json"


def identifier(memory: str, symbols: tuple[str, ...]) -> StateIdentifier:
    """The state identification of that name, over these symbols.

    Args:
        memory: ``none``: the state is the last symbol; ``last-N``: the last N symbols in their order; or the path of an
            automaton file: the state is that of the automaton.
        symbols: Names of the symbols.

    Raises:
        ConfigurationError: No such memory, one with more states than can be learned, or an automaton over other
            symbols.
    """
    if memory == NONE:
        return IdentityState(symbols)
    try:
        if memory.endswith(".json"):
            return AutomatonState.of(load(memory), symbols=symbols)
        if last := re.fullmatch(r"last-([1-9][0-9]?)", memory):
            return LastSymbols(symbols, int(last[1]))
    except ConfigurationError as error:
        raise ConfigurationError(_FIELD, memory, error.accepted) from error
    raise ConfigurationError(_FIELD, memory, _ACCEPTED)
