"""What the agent takes for its state, as the command line names it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from palpate.adapters.experiments.build import NONE, identifier
from palpate.core.automata.machine import Machine
from palpate.core.automata.strings import Strings
from palpate.core.automata.tracker import AutomatonState
from palpate.core.errors import ConfigurationError
from palpate.core.perception import StateIdentifier
from palpate.simulation.grid.maps import GridMap
from palpate.simulation.grid.strings import walk_strings

SYMBOLS: Final = "symbols"


@dataclass(frozen=True)
class Named:
    """States by a name.

    Attributes:
        name: ``symbols``; ``last-2``, ``last-3`` and so on; or an automaton file.
    """

    name: str = SYMBOLS

    def __call__(self, grid: GridMap) -> StateIdentifier:
        """The states of a map.

        Raises:
            ConfigurationError: There are no such states, more than can be learned, or the file is no automaton over
                symbols of the map.
        """
        try:
            return identifier(NONE if self.name == SYMBOLS else self.name, grid.symbols)
        except ConfigurationError as error:
            # In a grid the state without memory has another name than in the configuration of the insertion task.
            raise ConfigurationError("state", self.name, error.accepted.replace(f"{NONE},", f"{SYMBOLS},")) from error


@dataclass(frozen=True)
class Followed:
    """States of an automaton that follows the symbols.

    Attributes:
        machine: The automaton.
        strings: What it was inferred from, if that is known: transitions that never occurred there are not followed.
    """

    machine: Machine
    strings: Strings | None = None

    def __call__(self, grid: GridMap) -> StateIdentifier:
        """The states of a map.

        Raises:
            ConfigurationError: The automaton is over symbols that the map does not have.
        """
        return AutomatonState.of(self.machine, self.strings, symbols=grid.symbols)


def inferred(grid: GridMap, seed: int, walks: int, longest: int) -> Followed:
    """States of an automaton that is inferred from random walks in a map, as the paper does (section 4).

    Args:
        grid: The map.
        seed: Gives the walks and the first weights of the networks.
        walks: Number of walks.
        longest: Most symbols of a walk; longer ones are left out.

    Raises:
        ConfigurationError: The walks make no set of strings that an automaton can be inferred from.
    """
    # Here, because it loads torch, which nothing else about grids needs.
    from palpate.core.automata.infer import InferenceSettings, infer
    from palpate.core.automata.training import TrainingSettings

    strings = walk_strings(grid, walks, seed, longest)
    found = infer(strings, InferenceSettings(training=TrainingSettings(seed=seed)))
    return Followed(found.machine, strings)
