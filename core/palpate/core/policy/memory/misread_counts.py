"""Wrong readings in clone-structured models: whether trials hold any, and messages and counts that allow for them.

A wrong reading says nothing of the clone, so messages go between the clones of all symbols. That takes matrix products,
which have the same bits on every processor where all sums in them are exact: so their factors stand on grids.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np
from typing_extensions import override

from palpate.core.policy.belief import Floats
from palpate.core.policy.memory.clone_counts import Blocks, Clones
from palpate.core.policy.memory.recorded import Numbers, RecordedTrial

_FINE: Final = 2.0**26  # probabilities: a sum of products of two is below 2**53 of their units
_COARSE, _COARSER, _MOST = 2.0**18, 2.0**12, 2.0**14  # the two messages of a move; what the second is cut off at
_ROWS: Final = 256  # moves that are summed at a time: 2**18 * 2**14 * 2**12 * 2**8 < 2**53
_TAKEN: Final = 5  # times that each action has to be taken after another, to say which of them leads back


def third_readings(trials: Sequence[RecordedTrial], actions: int) -> float:
    """Share of the ways there and back on which neither the first nor the second symbol is read at last.

    The way back is the action that leads from what another one led to most often back to the symbol before. In a world
    in which moves can be undone it is none, whether or not moves fail by chance, unless readings are wrong.
    """
    ways = np.zeros((actions, actions, 3))
    for trial in trials:
        read = trial.symbols
        for number, (before, there, back) in enumerate(zip(read, read[1:], read[2:], strict=False)):
            if there != before:
                came_to = (before, there).index(back) if back in (before, there) else 2
                ways[trial.actions[number], trial.actions[number + 1], came_to] += 1.0
    total = ways.sum(axis=2)
    undoes = (ways[:, :, 0] / np.maximum(total, 1.0)).argmax(axis=1)
    tried = np.flatnonzero((total >= _TAKEN).all(axis=1))
    found = ways[tried, undoes[tried]].sum(axis=0)
    return float(found[2] / max(found.sum(), 1.0))


class Misread(Blocks):
    """Any symbol may be read in each clone."""

    def __init__(self, model: Clones) -> None:
        self.actions, self.states = model.goal.shape
        self.places = np.tile(np.arange(self.states), (model.symbols, 1))
        self.moves = _on_grid(model.transitions, _FINE)
        self._back = self.moves.swapaxes(1, 2).copy()  # in order in memory: half the time
        self._readings = model.emissions.T.copy()
        self._others = 1.0 - np.eye(model.symbols)[:, list(model.clones)]
        self._start, self._goal = model.start, model.goal

    @override
    def keys(self, actions: Numbers, symbols: Numbers, following: Numbers) -> Numbers:
        return actions

    @override
    def first(self, symbols: Numbers) -> Floats:
        probabilities: Floats = self._start * self._readings[symbols]
        return probabilities

    @override
    def forward(self, before: Floats, actions: Numbers, symbols: Numbers, following: Numbers) -> Floats:
        moved = _each(_on_grid(before, _FINE), actions, self.moves)
        moved *= self._readings[following] / (_FINE * _FINE)
        return moved

    @override
    def backward(self, after: Floats, actions: Numbers, symbols: Numbers, following: Numbers) -> Floats:
        moved = _each(_on_grid(after * self._readings[following], _FINE), actions, self._back)
        moved /= _FINE * _FINE
        return moved

    @override
    def goal(self, actions: Numbers, symbols: Numbers) -> Floats:
        return self._goal.take(actions, axis=0)

    @override
    def products(self, before: Floats, after: Floats, following: Numbers) -> Floats:
        most = before.max(axis=1, keepdims=True)
        after = _on_grid(np.minimum(after * self._readings[following] * most, _MOST), _COARSER)
        before = _on_grid(before / most, _COARSE)
        summed: Floats = np.zeros((self.states, self.states))
        for begin in range(0, len(before), _ROWS):
            rows = slice(begin, begin + _ROWS)
            summed += before[rows].T @ after[rows]
        return summed

    @override
    def counted(self, products: Floats) -> Floats:
        moves: Floats = products * self.moves / (_COARSE * _COARSER * _FINE)
        return moves

    @override
    def wrong(self, posterior: Floats, symbols: Numbers) -> float:
        return float((posterior * self._others[symbols]).sum())


def _by_action(actions: Numbers, count: int) -> tuple[Numbers, list[int]]:
    """An order by actions, and where each of them begins in it, and the last one ends."""
    order = np.argsort(actions, kind="stable")
    return order, np.searchsorted(actions[order], np.arange(count + 1)).tolist()


def _each(rows: Floats, actions: Numbers, moves: Floats) -> Floats:
    """Each row times the moves of its action."""
    order, bounds = _by_action(actions, len(moves))
    rows, moved, result = rows[order], np.empty_like(rows), np.empty_like(rows)
    for each, begin, end in zip(moves, bounds, bounds[1:], strict=False):
        np.matmul(rows[begin:end], each, out=moved[begin:end])
    result[order] = moved
    return result


def _on_grid(values: Floats, steps: float) -> Floats:
    whole: Floats = np.rint(values * steps)
    return whole
