"""A clone-structured model begun from a commuting map: one clone for each offset from the goal that was visited.

Where actions commute their displacements are learned (:mod:`~palpate.core.policy.memory.commuting`), and with them a
model of the offset from the goal. Its places become clones, from which Baum-Welch goes on as from any other beginning.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np

from palpate.core.policy.memory.clone_model import CloneModel
from palpate.core.policy.memory.commuting import commuting_steps
from palpate.core.policy.memory.finite_pomdp import MOST_BYTES
from palpate.core.policy.memory.offset_model import Offset, OffsetModel, fit_offsets
from palpate.core.policy.memory.recorded import Batch, RecordedTrial

_REACHES: Final = (6, 11, 21)
"""Steps from the goal that are thought of, along either side of the lattice: the first that hold the walks."""
_OUTSIDE: Final = 0.05  # share of the visits at the border, from which on walks went beyond it
_FAILS: Final = 0.1  # share of failing moves to begin with, which iterations lower
_ELSEWHERE: Final = 1e-3  # probability that an action leads anywhere else, to begin with: iterations may find it


def commuting_map(
    trials: Sequence[RecordedTrial], symbols: int, actions: int, *, seed: int, misread: float
) -> CloneModel | None:
    """The beginning of a model; None where trials show no displacements, or no walk reached the goal.

    Args:
        misread: Share of wrong readings to begin with; 0 for none.
    """
    steps = commuting_steps(trials, actions) if any(trial.reached for trial in trials) else None
    if steps is None:
        return None
    offsets = _offsets(trials, steps, symbols, seed)
    return None if offsets is None else _clones(offsets, misread).trimmed(Batch.of(trials))


def _offsets(trials: Sequence[RecordedTrial], steps: tuple[Offset, ...], symbols: int, seed: int) -> OffsetModel | None:
    anchored = [trial for trial in trials if trial.reached]  # the others fit in anywhere, in places of their own
    batch = Batch.of(anchored)
    for reach in _REACHES:
        if 8 * len(steps) * ((2 * reach + 1) ** 2 - 1) ** 2 > MOST_BYTES:
            break
        model = fit_offsets(anchored, steps, reach, symbols, seed=seed)
        _, visits, _ = model.improved(batch)
        border = np.array([max(abs(u), abs(v)) == reach for u, v in model.offsets])
        if visits[border].sum() < _OUTSIDE * visits.sum():
            return model
    return None


def _clones(offsets: OffsetModel, misread: float) -> CloneModel:
    world, read = offsets.pomdp(), offsets.emissions.argmax(axis=1)
    order, few = np.argsort(read, kind="stable"), _ELSEWHERE / len(read)
    moves = np.maximum(world.transitions[:, order][:, :, order], _FAILS * np.eye(len(read))) + few
    goal = world.goal[:, order] + few
    total = moves.sum(axis=2) + goal
    start, clones = world.start[order] + few, tuple(read[order].tolist())
    return CloneModel(
        clones, world.symbols, start / start.sum(), moves / total[:, :, None], goal / total, _FAILS, misread
    )
