"""Strings of actions and symbols, and all that is made of them: network, automaton, follower and files."""

from itertools import pairwise

import numpy as np
import pytest

from palpate.core.automata import (
    AutomatonState,
    InferenceSettings,
    Kind,
    Machine,
    Strings,
    TrainingSettings,
    infer,
    to_json_text,
)
from palpate.core.automata.document import from_json_text
from palpate.core.automata.elman import Architecture, Readout
from palpate.core.automata.prefix_tree import PrefixTree
from palpate.core.automata.restarts import Restarts, TrainingTask
from palpate.core.automata.string_files import strings_of, text_of
from palpate.core.errors import ConfigurationError
from palpate.core.perception import stage_from_dict, stage_to_dict

SYMBOLS, ACTIONS = ("A", "B"), ("left", "right")
FEW = Strings.of_walks(SYMBOLS, ACTIONS, [((0, 1), (1, 1)), ((0,), (0,)), ((1, 0), (0,))])
TEXT = "# alphabet: A B\n# actions: left right\nA right:B right:<end>\nA left:<end>\nB left:A\n"


def corridor(count: int, seed: int) -> Strings:
    """Walks in A A A A B, where the goal is left of the first: only one's own moves say where one is."""
    rng = np.random.default_rng(seed)
    walks = []
    for _ in range(count):
        places = [int(rng.integers(5))]
        moves: list[int] = []
        while places[-1] >= 0 and len(moves) < 30:
            moves.append(int(rng.integers(2)))
            places.append(min(places[-1] + 2 * moves[-1] - 1, 4))
        walks.append(([int(place == 4) for place in places if place >= 0], moves))
    return Strings.of_walks(SYMBOLS, ACTIONS, walks)


def test_files_hold_actions_and_whether_a_walk_was_cut_off() -> None:
    assert text_of(FEW) == TEXT
    assert strings_of(TEXT) == FEW
    assert FEW.alphabet == ("A", "B", "left:A", "left:B", "right:A", "right:B")
    assert FEW.ends == (1, 0, None)


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: strings_of(TEXT.replace("right:B", "B")), r"line\[3\] = 'B' is refused: a symbol first, then ACTION:"),
        (lambda: strings_of(TEXT.replace("left:A", "up:A")), r"line\[5\] = 'up:A'"),
        (lambda: Strings.of_walks(SYMBOLS, ACTIONS, [((0, 1, 0), (1,))]), r"actions = 1 is refused: an action between"),
        (lambda: Strings.of_walks(SYMBOLS, ACTIONS, [((0, 1), (2,))]), "symbols below 2 and actions below 2"),
        (lambda: Strings(("A", "B", "up:A"), ((0, 2),), actions=("up",), ends=(None,)), "each of them after each"),
        (lambda: Strings(FEW.alphabet, ((0, 1),), actions=ACTIONS, ends=(None,)), "a symbol, and then pairs"),
    ],
)  # fmt: skip
def test_strings_with_an_action_missing_or_unknown_are_refused(made, said) -> None:
    with pytest.raises(ConfigurationError, match=said):
        made()


@pytest.mark.parametrize("order", [1, 2])
def test_the_loss_counts_what_followed_each_action(order) -> None:
    strings = corridor(20, 3)
    tree = PrefixTree.of(strings)
    shape = Architecture(
        alphabet=strings.alphabet, reading=Readout.PREDICTION, hidden=3, order=order, actions=strings.actions
    )
    task, restarts = TrainingTask(tree, shape), Restarts(shape, 2, seed=1)
    losses, _ = task.losses(restarts, restarts.hidden_states(task.levels))
    for place in range(2):
        network = restarts.network(place)
        total, count = 0.0, 0
        for word, end in zip(strings.words, strings.ends, strict=True):
            states = [network.advance(network.start_state[np.newaxis], word[0])]
            for letter in word[1:]:
                states.append(network.advance(states[-1], letter))
            shares = [network.read(state)[0].reshape(2, 3) for state in states]
            for before, (_, letter) in zip(shares, pairwise(word), strict=False):
                total -= np.log(before[letter // 2 - 1, letter % 2])
            total -= 0.0 if end is None else np.log(shares[-1][end, 2])
            count += len(word) - 1 + (end is not None)
        assert losses[place].item() == pytest.approx(total / count, rel=1e-4)
        assert network.hidden_states(tree)[tree.nodes[-1]] == pytest.approx(states[-1][0])


QUICK = InferenceSettings(hidden=4, finalists=2, training=TrainingSettings(restarts=8, batch=8, steps=120))


@pytest.fixture(scope="module")
def found():
    return infer(corridor(160, 1), QUICK)


def test_the_automaton_holds_what_was_done_beyond_the_last_three(found) -> None:
    assert found.chosen.loss < 0.8 * min(found.beside.values())
    assert found.machine.actions == ACTIONS
    assert from_json_text(to_json_text(found.machine)) == found.machine
    assert '"actions"' not in to_json_text(Machine(Kind.DFA, ("a",), ((0,),), (True,)))


def test_of_shuffled_strings_and_untrained_networks_no_gain_is_invented(found) -> None:
    strings, rng = corridor(160, 1), np.random.default_rng(0)
    letters = iter(rng.permutation([letter for word in strings.words for letter in word[1:]]).tolist())
    words = [(word[0], *(next(letters) for _ in word[1:])) for word in strings.words]
    shuffled = infer(Strings(strings.alphabet, tuple(words), actions=ACTIONS, ends=strings.ends), QUICK)
    # The strings that are held out choose among networks too, and how long walks are is not shuffled.
    assert shuffled.chosen.loss > 0.98 * min(shuffled.beside.values())
    untrained = infer(strings, InferenceSettings(hidden=4, training=TrainingSettings(restarts=8, batch=8, steps=0)))
    assert untrained.chosen.loss > 1.1 * found.chosen.loss


def test_it_is_followed_by_action_and_symbol(found) -> None:
    state = AutomatonState.of(found.machine, corridor(160, 1))
    assert stage_from_dict(stage_to_dict(state)) == state
    state.update(1)
    after = [state.update(0, "left") for _ in range(4)]
    assert len(set(after)) == 4
    assert state.lost_steps == 0
    # From B nothing but "right" leads back to B at once: such a step is none it has seen, and it goes on.
    state.reset()
    state.update(1)
    assert state.update(1, "left") != state.lost
    assert state.update(0, "nowhere") != state.lost
    assert state.lost_steps == 2
    with pytest.raises(ConfigurationError, match="a list of names, each only once"):
        stage_from_dict(stage_to_dict(state) | {"actions": []})
