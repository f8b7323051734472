"""Fitting clone-structured models: from a commuting map or from random beginnings, merged and divided.

Where trials show that actions commute, their displacements are learned first, and a model begins with a clone for each
offset from the goal. It is kept where held-out trials are foretold much the better for it than by a random beginning;
all that follows is for worlds in which actions do not commute, or trials do not show it.

Baum-Welch finds one of many local optima. One place has several clones then, each with a share of what was seen there;
where moves fail by chance, a failed one is taken for a move to another of them. And one clone stands for several
places. So clones of a symbol that the trials do not tell apart are merged, and those whose moves lead to the most
different ends are divided at random and fitted on, as long as held-out trials are foretold the better for it. That is
done where merged clones show a share of moves that fail. Where none do, too many clones do no harm, and to take each
action for one that leads to a single place does: where a model is wrong yet, its belief is sure of it.

A wrong reading would need a clone of its own wherever it was read. So where trials show wrong readings any symbol may
be read in each clone, from the beginning on, and one such model is merged and divided. It is kept where held-out trials
gain much by that: where they gain little it is sure of places that are none, and plans worse than ordinary models do.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from palpate.core.policy.belief import Floats, logarithm
from palpate.core.policy.memory.clone_model import CloneModel
from palpate.core.policy.memory.commuting_map import commuting_map
from palpate.core.policy.memory.hidden_markov import LEAST
from palpate.core.policy.memory.misread_counts import third_readings
from palpate.core.policy.memory.recorded import Batch, Numbers, RecordedTrial

HIDDEN: Final = 140
"""Hidden states that a model is begun with: more than there are places, which leads out of local optima."""
_GUESSES: Final = 5  # random beginnings
KEPT: Final = 3
"""Models that are kept."""
_FIRST, _FURTHER = 25, 15  # iterations: of all guesses; of a round of those kept, and of these on all trials
_MISREAD, _AFTER = 20, 10  # the same where readings are wrong, which takes longer each: at first, and whenever after
_TOLD: Final = 20  # of those kept, where their clones are told
_ROUNDS: Final = 5  # at most
_GAIN: Final = 0.03  # a round that lowers the loss on held-out trials by a smaller share is the last
_MERGED: Final = (10.0, 20.0, 40.0)  # nats that telling two clones apart has to be worth, from round to round
_FAIL: Final = 0.1  # share of failing moves that a round begins with, at least
_LOOKED, _FAILING = 3, 0.04  # iterations after which so many moves have to fail for clones to be divided
_DIVIDED_KEPT: Final = 2  # models that are kept then: they take longer, and differ less
_DIVISIONS: Final = 3  # at most
_DIVIDED, _AGAIN = 0.25, 10  # share of the clones that are divided; sparse iterations after they were merged again
_VISITS: Final = 10.0  # at least, of a clone that is divided
_A_DIVISION: Final = 100  # trials for each division where readings are wrong: early models do not last
_STAYS: Final = 0.95  # share of what stays in a clone that stays in the same half, where moves do not fail by chance
_FOUND: Final = 0.75  # of the loss before, at most, where places were found; 0.34 to 0.55 then, else 0.9 and more
_PLACED: Final = 0.9  # of the loss from a random beginning, at most, where a commuting map holds
_ON_MAP, _AT_LAST = 3, 5  # sparse iterations from a commuting map, and then on all trials
_WRONG: Final = 0.01  # ways there and back that end at a third symbol: from here on readings are wrong


def clones_of(trials: Sequence[RecordedTrial], symbols: int, total: int) -> tuple[int, ...]:
    """Symbols of about so many hidden states: as many clones as a symbol is frequent, and at least two."""
    counts = np.bincount([symbol for trial in trials for symbol in trial.symbols], minlength=symbols)
    shares = [max(2, round(total * int(count) / int(counts.sum()))) for count in counts]
    return tuple(symbol for symbol, share in enumerate(shares) for _ in range(share))


def fit_clones(
    trials: Sequence[RecordedTrial],
    symbols: int,
    actions: int,
    *,
    seed: int = 0,
    clones: tuple[int, ...] | None = None,
    guesses: int = _GUESSES,
    kept: int = KEPT,
    merging: bool = False,
    misreading: bool = False,
    commuting: bool = False,
) -> tuple[CloneModel, ...]:
    """Fit models from scratch; the best of them by their loss on held-out trials come first.

    Args:
        trials: What was read and done, at least ten trials; one of five is held out.
        clones: Symbol of each hidden state, in rising order; None for as many as a symbol is frequent.
        guesses: Random beginnings.
        kept: Models that are kept.
        merging: Where moves fail by chance, merge and divide clones if held-out trials are foretold the better for it.
        misreading: Where readings are wrong, learn their share, merging and dividing too.
        commuting: Where actions commute, begin from the displacements that trials show, and from nothing else.
    """
    rng = np.random.default_rng(seed)
    most, held = [trial for number, trial in enumerate(trials) if number % 5 != 4], trials[4::5]
    taught = Batch.of(most)
    told, whole = clones is not None, Batch.of(trials)
    clones = clones or clones_of(trials, symbols, HIDDEN)
    wrong = third_readings(trials, actions) if misreading and not told else 0.0
    if commuting and not told:
        misread = wrong if wrong > _WRONG else 0.0
        placed = commuting_map(most, symbols, actions, seed=seed, misread=misread)
        if placed is not None:
            placed = placed.fitted(taught, _ON_MAP, sparse=True)
            if len(placed.clones) > HIDDEN:  # of few walks: some places stand in it more than once
                placed = placed.fitted(taught, _FURTHER)
            if _holds(placed, taught, held, clones, seed):
                return (placed.fitted(whole, _AT_LAST, sparse=True).rounded(),)
    if wrong > _WRONG:
        blank = replace(CloneModel.blank(clones, symbols, actions, rng), misread=wrong).fitted(taught, _MISREAD)
        found = divided(blank, taught, held, rng)
        if found.log_loss(held) < _FOUND * blank.log_loss(held):
            return (_finished(found, whole).rounded(),)
        guesses, kept = min(guesses, _DIVIDED_KEPT + 1), min(kept, _DIVIDED_KEPT)  # for the time that this took
    begun = [CloneModel.blank(clones, symbols, actions, rng).fitted(taught, _FIRST) for _ in range(guesses)]
    begun = _best(begun, held, kept)
    if told:  # as many as they are
        better = [guess.fitted(taught, _TOLD) for guess in begun]
        return tuple(model.fitted(whole, _FURTHER).rounded() for model in _best(better, held, kept))
    better = [ripened(begun[0], taught, held)]
    loose = merged(better[0], taught, _MERGED[-1]).fitted(taught, _LOOKED) if merging else better[0]
    if loose.fails > _FAILING:
        taken = _best([divided(guess, taught, held, rng) for guess in begun[:_DIVIDED_KEPT]], held, kept)
        if taken[0].log_loss(held) < better[0].log_loss(held):
            return tuple(_finished(model, whole).rounded() for model in taken)
    better += [ripened(guess, taught, held) for guess in begun[1:]]
    return tuple(model.trimmed(whole).fitted(whole, _FURTHER).rounded() for model in _best(better, held, kept))


def _holds(placed: CloneModel, batch: Batch, held: Sequence[RecordedTrial], clones: tuple[int, ...], seed: int) -> bool:
    """Whether a commuting map foretells held-out trials much better than a fit from a random beginning.

    Where it has more clones than that, as a torus has that is taken for a plane, better than one brought to its end.
    """
    loss = placed.log_loss(held)
    other = CloneModel.blank(clones, placed.symbols, len(placed.goal), np.random.default_rng(seed))
    other = other.fitted(batch, _FIRST)
    if len(placed.clones) <= HIDDEN:
        return loss < _PLACED * other.log_loss(held)
    return loss < other.log_loss(held) and loss < ripened(other, batch, held).log_loss(held)


def _best(models: Sequence[CloneModel], held: Sequence[RecordedTrial], count: int) -> list[CloneModel]:
    losses = [model.log_loss(held) for model in models]
    return [models[place] for place in sorted(range(len(models)), key=losses.__getitem__)[:count]]


def ripened(
    model: CloneModel, batch: Batch, held: Sequence[RecordedTrial], worth: Sequence[float | None] = (None,)
) -> CloneModel:
    """After as many rounds of iterations as held-out trials are foretold the better for, trimmed before each.

    Args:
        worth: Nats that telling two clones apart has to be worth, from round to round; None to merge none.
    """
    loss = np.inf
    for number in range(_ROUNDS):
        further = _thinned(model, batch, worth[min(number, len(worth) - 1)]).fitted(batch, _FURTHER)
        before, loss = loss, further.log_loss(held)
        if loss >= before:
            break
        model = further
        if loss > (1.0 - _GAIN) * before:
            break
    return model


def divided(model: CloneModel, batch: Batch, held: Sequence[RecordedTrial], rng: np.random.Generator) -> CloneModel:
    """With merged clones, and those divided that stand for several places, as long as held-out trials gain by it."""
    divisions, iterations = _DIVISIONS, _iterations(model)
    if model.misread:
        divisions = max(1, int(batch.weights.sum()) // _A_DIVISION)
        for worth in _MERGED:
            model = _thinned(model, batch, worth).fitted(batch, iterations)
    else:
        model = ripened(model, batch, held, _MERGED)
    loss = model.log_loss(held)
    for _ in range(divisions):
        further = _thinned(_parted(model, batch, rng).fitted(batch, iterations), batch, _MERGED[-1])
        further = further.fitted(batch, _AGAIN, sparse=True)
        before, loss = loss, further.log_loss(held)
        if loss >= before:
            break
        model = further
    return model


def _finished(model: CloneModel, batch: Batch) -> CloneModel:
    """Fitted to all trials at last."""
    return _thinned(model, batch, _MERGED[-1]).fitted(batch, _iterations(model)).fitted(batch, _AGAIN, sparse=True)


def _iterations(model: CloneModel) -> int:
    return _AFTER if model.misread else _FURTHER


def _thinned(model: CloneModel, batch: Batch, worth: float | None) -> CloneModel:
    model = model.trimmed(batch)
    return model if worth is None else merged(model, batch, worth)


def merged(model: CloneModel, batch: Batch, worth: float) -> CloneModel:
    """With one clone for any two of a symbol if what follows them is foretold no worse than by so many nats.

    Of more than two the closest come first; each is looked at again with what has become of the others. A trial may
    begin in each as often as it is visited: else clones that stand for several places at the start would stay.
    """
    counts = _outcomes(model, batch)
    clones, kept = np.array(model.clones), np.ones(len(model.clones), dtype=bool)
    while pairs := _alike(counts, clones, kept, worth):
        for one, other in pairs:
            counts[:, one] += counts[:, other]
            counts[:, :, one] += counts[:, :, other]
            counts[:, other], counts[:, :, other] = 0.0, 0.0
            kept[other] = False
    few = 1.0 / int(kept.sum())
    moves, goals = counts[:, kept][:, :, :-1][:, :, kept] + few, counts[:, kept, -1] + few
    total = moves.sum(axis=2) + goals
    start = total.sum(axis=0) / total.sum()
    left, fails = tuple(clones[kept].tolist()), 0.0 if model.misread else max(model.fails, _FAIL)
    return CloneModel(left, model.symbols, start, moves / total[:, :, None], goals / total, fails, model.misread)


def _parted(model: CloneModel, batch: Batch, rng: np.random.Generator) -> CloneModel:
    """With two for each of the clones whose moves lead to the most different ends, at random."""
    counts, states, fails = _outcomes(model, batch), len(model.clones), model.fails
    visits = counts.sum(axis=(0, 2))
    doubt = np.where(visits >= _VISITS, _spread(counts) / np.maximum(visits, LEAST), 0.0)
    most = np.argsort(-doubt, kind="stable")[: max(1, int(_DIVIDED * states))]
    parted = np.sort(most[doubt[most] > 0.0])
    # Beside what stays by chance; each of the two gets a share of what led to both, and leads elsewhere in part.
    ways = np.concatenate((model.transitions - fails * np.eye(states), model.goal[:, :, None]), axis=2)
    ways = np.maximum(np.concatenate((ways, ways[:, parted]), axis=1), 0.0)
    both = np.concatenate((parted, np.arange(states, ways.shape[1])))
    ways[:, both] *= 0.05 + rng.random((len(ways), len(both), states + 1))
    goal, moves = ways[:, :, -1], ways[:, :, :-1]
    share = rng.random((len(ways), ways.shape[1], len(parted)))
    if not fails:
        halves = np.arange(len(parted))
        share[:, parted, halves], share[:, states + halves, halves] = _STAYS, 1.0 - _STAYS
    moves = np.concatenate((moves, moves[:, :, parted] * (1.0 - share)), axis=2)
    moves[:, :, parted] *= share
    total = (moves.sum(axis=2) + goal) / (1.0 - fails)
    moves = moves / total[:, :, None] + fails * np.eye(len(total[0]))
    start = np.concatenate((model.start, 0.5 * model.start[parted]))
    start[parted] *= 0.5
    clones = np.array(model.clones)
    clones = np.concatenate((clones, clones[parted]))
    order = np.argsort(clones, kind="stable")
    moves, goal = moves[:, order][:, :, order], (goal / total)[:, order]
    return CloneModel(tuple(clones[order].tolist()), model.symbols, start[order], moves, goal, fails, model.misread)


def _outcomes(model: CloneModel, batch: Batch) -> Floats:
    """What each action came to from each clone, the goal last, (actions, clones, clones + 1)."""
    found = model.expected(batch)
    return np.concatenate((found.moves, found.goals[:, :, None]), axis=2)


def _alike(counts: Floats, clones: Numbers, kept: NDArray[np.bool_], worth: float) -> list[tuple[int, int]]:
    """Pairs of clones of one symbol that are told apart by no more nats than that, the closest first, none twice."""
    found: list[tuple[float, int, int]] = []
    for symbol in np.unique(clones):
        mine = np.flatnonzero(kept & (clones == symbol))
        rows = counts[:, mine]
        alone, (first, second) = _spread(rows), np.triu_indices(len(mine), 1)
        lost = _spread(rows[:, first] + rows[:, second]) - alone[first] - alone[second]
        found += [(float(lost[k]), int(mine[first[k]]), int(mine[second[k]])) for k in np.flatnonzero(lost <= worth)]
    pairs, taken = [], set[int]()
    for _, one, other in sorted(found):
        if not taken & {one, other}:
            pairs.append((one, other))
            taken |= {one, other}
    return pairs


def _spread(rows: Floats) -> Floats:
    """Nats that the outcomes of each clone's actions cost by its own counts of them, (clones,)."""
    total = rows.sum(axis=2)
    nats: Floats = (_weighed(total) - _weighed(rows).sum(axis=2)).sum(axis=0)
    return nats


def _weighed(counts: Floats) -> Floats:
    weighed: Floats = counts * logarithm(np.maximum(counts, LEAST))
    return weighed
