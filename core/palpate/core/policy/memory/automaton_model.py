"""Automata with actions as models of the world: each state of the automaton is a hidden state.

A recurrent network with a normalised hidden layer (:mod:`palpate.core.automata.elman`) follows the belief of a hidden
Markov model: so it is fitted as one, by Baum-Welch, which takes a tenth of the time that gradients take and foretells
held-out trials better. Partitioning its hidden space gives the automaton, and what follows in each state is counted,
beside what the network predicts there. An automaton by itself is always in one state, and where it is wrong nothing
leads back. So a small share of its moves is taken to lead wherever the action leads at all: the belief then spreads
over the states that go with what was read and done, and by Bayes' rule comes back to the right one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from palpate.core.automata import (
    MOST_HIDDEN,
    NONE,
    NORMALISED,
    Architecture,
    AutomatonState,
    Network,
    Partition,
    PrefixTree,
    Readout,
    Strings,
    bounded_partition,
)
from palpate.core.errors import ConfigurationError
from palpate.core.policy.belief import Floats, logarithm
from palpate.core.policy.memory.belief import IMPOSSIBLE, StateBelief
from palpate.core.policy.memory.clone_fit import fit_clones
from palpate.core.policy.memory.clone_model import CloneModel
from palpate.core.policy.memory.finite_pomdp import rounded
from palpate.core.policy.memory.point_based import StatePlan
from palpate.core.policy.memory.recorded import Numbers, RecordedTrial

_UNITS: Final = MOST_HIDDEN
"""Hidden units of the network, at most: as many for each symbol, and at least two."""
_NETWORKS, _GUESSES = 2, 6  # that are kept, and random beginnings
_LONGEST: Final = 60  # readings of a trial that the network is fitted to: long ones say little more
_INTERVALS, _STATES = 12, 3000  # of the partition: q, fewer where strings alone lead to more states; most states
_FORETOLD: Final = 2.0  # visits of a state that the prediction of the network is worth
_WRONG: Final = 0.1  # share of the moves in which the automaton is taken to be wrong


@dataclass(frozen=True, eq=False)
class AutomatonModel:
    """Where each action leads from each state, by what is read then: a world with hidden states by itself.

    Attributes:
        symbol_of: Symbol that leads into each state, (states,); -1 for the state before the first symbol.
        start: Probability of each state after the first symbol, (states,).
        targets: State after each state, action and symbol, (states, actions, symbols); -1 where none is known.
        shares: Probability of each symbol and, last, of the goal, (states, actions, symbols + 1).
        jumps: Probability of each state after an action, whatever was before it, (actions, states).

    Raises:
        ConfigurationError: Shapes that do not fit, or a state or a symbol that there is not.
    """

    symbol_of: Numbers
    start: Floats
    targets: Numbers
    shares: Floats
    jumps: Floats

    def __post_init__(self) -> None:
        states, actions, symbols = len(self.start), len(self.jumps), self.targets.shape[-1]
        shapes = {
            "symbol_of": (states,),
            "targets": (states, actions, symbols),
            "shares": (states, actions, symbols + 1),
            "jumps": (actions, states),
        }
        for name, shape in shapes.items():
            found = getattr(self, name).shape
            if found != shape:
                raise ConfigurationError(f"model.{name}", f"shape {found}", f"shape {shape}")
        for name in ("start", "shares", "jumps"):
            least = float(getattr(self, name).min())
            if least < 0.0:
                raise ConfigurationError(f"model.{name}", least, "probabilities")
        for name, most in (("symbol_of", symbols), ("targets", states)):
            numbers: Numbers = getattr(self, name)
            strange = numbers[(numbers < NONE) | (numbers >= most)]
            if strange.size:
                raise ConfigurationError(f"model.{name}", int(strange.flat[0]), f"numbers from -1 to {most - 1}")

    @property
    def states(self) -> int:
        """Number of hidden states."""
        return len(self.start)

    @property
    def actions(self) -> int:
        """Number of actions."""
        return len(self.jumps)

    @property
    def symbols(self) -> int:
        """Number of symbols."""
        return int(self.targets.shape[2])

    def pomdp(self) -> Self:
        """Itself."""
        return self

    def moved(self, probabilities: Floats, action: int) -> Floats:
        """Probability of each state after an action, (states,)."""
        joint = probabilities[:, None] * self.shares[:, action, :-1]
        # What leads nowhere known is counted first.
        led = np.bincount(self.targets[:, action].ravel() + 1, weights=joint.ravel(), minlength=self.states + 1)
        anywhere = led[0] + _WRONG * led[1:].sum()
        after: Floats = (1.0 - _WRONG) * led[1:] + anywhere * self.jumps[action]
        return after

    def emission(self, symbol: int) -> Floats:
        """Probability of a symbol in each state, (states,)."""
        return np.where(self.symbol_of == symbol, 1.0, 0.0)

    def plan(self) -> StatePlan:
        """By what each action costs in each state: there is one state for all that was read and done."""
        return StatePlan.of(self, self.targets, self.shares[:, :, :-1])

    def log_loss(self, trials: Sequence[RecordedTrial]) -> float:
        """Nats a reading that these trials cost under the model; an arrival at the goal counts as one."""
        likelihoods = []
        for trial in trials:
            belief = StateBelief(self, trial.symbols[0])
            likelihoods.append(belief.likelihood)
            for action, symbol in zip(trial.actions, trial.symbols[1:], strict=False):
                belief.update(action, symbol)
                likelihoods.append(belief.likelihood)
            if trial.reached:
                arrived = float(belief.probabilities @ self.shares[:, trial.actions[-1], -1])
                likelihoods.append(max(arrived, IMPOSSIBLE))
        return -float(logarithm(np.array(likelihoods)).mean())


def units_of_each(symbols: int) -> int:
    """Hidden units for each symbol.

    Raises:
        ConfigurationError: There is no telling them apart, or no room for two of each.
    """
    if not 2 <= symbols <= _UNITS // 2:
        raise ConfigurationError("symbols", symbols, f"from 2 to {_UNITS // 2}, for an automaton")
    return _UNITS // symbols


def fit_automata(
    trials: Sequence[RecordedTrial], symbols: int, actions: int, *, seed: int = 0
) -> tuple[AutomatonModel, ...]:
    """Fit models from scratch; that of the network with the least loss on held-out trials comes first.

    Args:
        trials: What was read and done, at least ten trials; one of five is held out.
    """
    clones = tuple(symbol for symbol in range(symbols) for _ in range(units_of_each(symbols)))
    cut = [_cut(trial) for trial in trials]
    worlds = fit_clones(cut, symbols, actions, seed=seed, clones=clones, guesses=_GUESSES, kept=_NETWORKS)
    names, moves = [str(number) for number in range(symbols)], [str(number) for number in range(actions)]
    tree = PrefixTree.of(Strings.of_walks(names, moves, [(trial.symbols, trial.actions) for trial in trials]))
    return tuple(_counted(_partition(network_of(world, tree.alphabet, moves), tree), tree) for world in worlds)


def network_of(world: CloneModel, alphabet: Sequence[str], actions: Sequence[str]) -> Network:
    """The network whose hidden units hold the belief over clones, as many of each symbol."""
    symbols, count = world.symbols, len(world.clones)
    # Units of a network take turns over the symbols.
    order = np.arange(count).reshape(symbols, -1).T.ravel()
    shape = Architecture(
        alphabet=tuple(alphabet), reading=Readout.PREDICTION, hidden=count, activation=NORMALISED, order=2,
        actions=tuple(actions),
    )  # fmt: skip
    start = world.start[order]
    moves = world.transitions[:, order][:, :, order].transpose(0, 2, 1)
    first = np.repeat(start[:, None], count, axis=1)
    by_symbol = moves.reshape(len(moves), -1, symbols, count).sum(axis=1)
    output = np.concatenate((by_symbol, world.goal[:, None, order]), axis=1)
    output /= output.sum(axis=1, keepdims=True)
    recurrent = np.concatenate((first[None], moves))
    return Network(shape, recurrent, shape.kept, start, output.reshape(-1, count), np.zeros(shape.outcomes))


def _cut(trial: RecordedTrial) -> RecordedTrial:
    if len(trial.actions) <= _LONGEST:
        return trial
    return RecordedTrial(trial.symbols[: _LONGEST + 1], trial.actions[:_LONGEST], reached=False)


def _partition(network: Network, tree: PrefixTree) -> Partition:
    for intervals in range(_INTERVALS, 1, -1):
        found = bounded_partition(network, intervals, _STATES, by_symbol=True, tree=tree)
        if found is not None:
            return found
    return bounded_partition(network, 1, by_symbol=True, tree=tree)  # type: ignore[return-value]  # one a symbol


def _counted(cells: Partition, tree: PrefixTree) -> AutomatonModel:
    """The minimised automaton, with what followed in each of its states."""
    machine, shape = cells.minimal(), cells.network.architecture
    follower = AutomatonState.of(machine)
    lost, sides = follower.lost, (follower.lost, len(shape.actions), len(shape.names) + 1)
    table = np.minimum(follower.table(), lost)
    at = tree.states(table, machine.start)
    counts = np.zeros((lost + 1, shape.outcomes))
    np.add.at(counts, at, tree.counts)
    shares = (counts[:lost] + _FORETOLD * cells.predicted(machine)).reshape(sides)
    targets = table[:lost, len(shape.names) :].reshape(*sides[:2], -1)
    symbol_of = np.array([NONE if symbol is None else symbol for symbol in follower.symbol_of[:lost]])
    jumps = np.zeros((sides[1], lost + 1))
    visits = counts[:lost].reshape(sides)
    for action, row in enumerate(jumps):
        np.add.at(row, targets[:, action], visits[:, action, :-1])
    jumps = (jumps[:, :lost] + 0.01 / lost) * (symbol_of >= 0)
    starts = np.bincount(at[1 : tree.levels[2]], weights=tree.passes[1 : tree.levels[2]], minlength=lost + 1)[:lost]
    return AutomatonModel(
        symbol_of,
        rounded(starts / starts.sum()),
        np.where(targets < lost, targets, NONE),
        rounded(shares / shares.sum(axis=2, keepdims=True)),
        rounded(jumps / jumps.sum(axis=1, keepdims=True)),
    )
