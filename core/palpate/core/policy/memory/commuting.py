"""Actions that commute: whether trials show that actions undo each other and their order does not matter.

Where that is so, an action has a displacement that is the same everywhere, and it follows from symbols and actions
alone, up to how the plane is turned, mirrored or sheared: two actions that undo each other are opposite, three that
lead back to where they began add up to nothing. Only moves that changed the symbol are counted on, so those that were
blocked or failed drop out. A way that closes ends at its first symbol, others do as often as chance has it.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, combinations_with_replacement, permutations
from typing import Final

import numpy as np

from palpate.core.policy.belief import Floats, logarithm
from palpate.core.policy.memory.offset_model import Offset
from palpate.core.policy.memory.recorded import RecordedTrial

_SURE: Final = 5.0  # nats by which ways have to be likelier as closed ones than as any others
_CLOSED: Final = 0.98  # of the closed ways come back, at most: one that does not is no proof
_TAKEN: Final = 5  # times that each action has to be taken after another, to say which of them leads back
_LONGEST: Final = 4  # of the ways that are looked at


def commuting_steps(trials: Sequence[RecordedTrial], actions: int) -> tuple[Offset, ...] | None:
    """Displacement of each action on a lattice, in steps, the shortest that fit; None where trials do not show one."""
    back, total = _counts(trials, actions, 2)
    if not (total >= _TAKEN).all():
        return None
    undone = (back / total).argmax(axis=1)
    best = np.zeros((actions, actions), dtype=bool)
    best[np.arange(actions), undone] = True
    closed = min(_CLOSED, float(back[best].sum() / total[best].sum()))
    nats = _nats(back + back.T, total + total.T, closed, float(back[~best].sum() / max(total[~best].sum(), 1.0)))
    opposite = {a: int(b) for a, b in enumerate(undone) if undone[b] == a != b and nats[a, b] > _SURE}
    if len(opposite) < actions:
        return None
    steps = _shortest(opposite, _triangles(trials, opposite, closed))
    return steps if steps and _order_does_not_matter(trials, steps, closed) else None


def _ways(trials: Sequence[RecordedTrial], length: int) -> Iterator[tuple[tuple[int, ...], bool]]:
    """Actions of all ways whose moves but the last one changed the symbol, and whether they end at the first symbol."""
    for trial in trials:
        read, moved = trial.symbols, 0
        for number in range(1, len(read)):
            begin = number - length
            if begin >= 0 and moved >= length - 1:
                yield trial.actions[begin:number], read[number] == read[begin]
            moved = moved + 1 if read[number] != read[number - 1] else 0


def _counts(trials: Sequence[RecordedTrial], actions: int, length: int) -> tuple[Floats, Floats]:
    """How often each way came back, and how often it was gone, (actions, ...) each."""
    back, total = np.zeros((2, *(actions,) * length))
    for way, came_back in _ways(trials, length):
        back[way] += came_back
        total[way] += 1.0
    return back, total


def _nats(back: Floats, total: Floats, closed: float, chance: float) -> Floats:
    """By how much so many ways that came back are likelier among closed ones than among any."""
    closed, chance = max(closed, 1e-3), min(max(chance, 1e-3), 1.0 - 1e-3)
    if closed <= chance:
        return np.full_like(total, -np.inf)
    gains = logarithm(np.array([closed / chance, (1.0 - closed) / (1.0 - chance)]))
    nats: Floats = back * gains[0] + (total - back) * gains[1]
    return nats


def _triangles(
    trials: Sequence[RecordedTrial], opposite: Mapping[int, int], closed: float
) -> dict[tuple[int, ...], float]:
    """Any three actions that lead back to where they began, in whatever order, and their opposites, and the nats."""
    actions = len(opposite)
    back, total = _counts(trials, actions, 3)
    for a, b in opposite.items():
        back[a, b], total[a, b], back[:, a, b], total[:, a, b] = 0.0, 0.0, 0.0, 0.0
    chance = float(back.sum() / max(total.sum(), 1.0))
    found = dict[tuple[int, ...], float]()
    for three in combinations_with_replacement(range(actions), 3):
        if not any(opposite[action] in three for action in three):
            both = three, tuple(opposite[action] for action in three)
            orders = tuple(np.array(sorted({order for each in both for order in permutations(each)})).T)
            nats = float(_nats(back[orders].sum(), total[orders].sum(), closed, chance))
            if nats > _SURE:
                found[three] = nats
    return found


def _shortest(opposite: Mapping[int, int], triangles: Mapping[tuple[int, ...], float]) -> tuple[Offset, ...] | None:
    """Displacements by which most of these add up to nothing; of several the shortest."""
    found = [steps for two in combinations(opposite, 2) if (steps := _spanned(*two, opposite, triangles))]

    def preferred(steps: Sequence[Offset]) -> tuple[float, int]:
        closed = (
            nats for three, nats in triangles.items() if not np.array([steps[k] for k in three]).sum(axis=0).any()
        )
        return -sum(closed), sum(u * u + v * v for u, v in steps)

    return min(found, key=preferred, default=None)


def _spanned(
    first: int, second: int, opposite: Mapping[int, int], triangles: Mapping[tuple[int, ...], float]
) -> tuple[Offset, ...] | None:
    """Displacements of all actions if these two are the sides of the lattice, by the surest triangles."""
    steps: dict[int, tuple[int, int]] = {first: (1, 0), second: (0, 1)}
    if second == opposite[first]:
        return None
    while True:
        steps |= {opposite[action]: (-u, -v) for action, (u, v) in steps.items()}
        for three in sorted(triangles, key=lambda three: -triangles[three]):
            left = [action for action in three if action not in steps]
            if len(left) == 1:
                told = [steps[action] for action in three if action in steps]
                steps[left[0]] = -sum(u for u, _ in told), -sum(v for _, v in told)
                break
        else:
            return tuple(steps[action] for action in range(len(opposite))) if len(steps) == len(opposite) else None


def _order_does_not_matter(trials: Sequence[RecordedTrial], steps: Sequence[Offset], closed: float) -> bool:
    """Whether ways that add up to nothing come back, beyond those that go back step by step."""
    counts = np.zeros((2, 2))
    for length in range(2, _LONGEST + 1):
        for way, back in _ways(trials, length):
            moved = np.array([steps[action] for action in way])
            if (moved[:-1] + moved[1:]).any(axis=1).all():
                counts[int(not moved.sum(axis=0).any()), int(back)] += 1.0
    chance = float(counts[0, 1] / max(counts[0].sum(), 1.0))
    return float(_nats(counts[1, 1:], counts[1:].sum(axis=1), closed, chance)[0]) > _SURE
