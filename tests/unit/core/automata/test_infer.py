from dataclasses import replace

import pytest

from palpate.core.automata import Kind, Machine, PrefixTree, Strings, difference
from palpate.core.automata.choice import ExtractionSettings
from palpate.core.automata.elman import END
from palpate.core.automata.infer import InferenceSettings, _acceptor, infer
from palpate.core.automata.training import Progress, TrainedNetwork, TrainingSettings
from palpate.core.errors import ConfigurationError
from tests.unit.core.automata.networks import LARGE, parity

BINARY = [f"{n:0{length}b}" if length else "" for length in range(7) for n in range(2**length)]
ODD_ZEROS = Strings.of(BINARY, [word.count("0") % 2 == 1 for word in BINARY])
# Walks between three places in a row, a b c, that end right of c. Whoever comes to b from a goes on to c.
WALKS = Strings.of(["abc", "bc", "abcbc", "c", "bcbcbc", "cbc", "abcbcbc", "bcbc", "cbcbc"] * 40)


def test_a_language_is_inferred_from_labelled_strings_and_held_out_ones_judge_it() -> None:
    told: list[Progress] = []
    training = TrainingSettings(restarts=32, steps=400, enough=4)
    found = infer(ODD_ZEROS, InferenceSettings(order=2, held_out=0.25, training=training), progress=told.append)
    assert difference(found.machine, Machine(Kind.DFA, ("0", "1"), ((1, 0), (0, 1)), (False, True))) is None
    assert found.consistent is True
    assert (found.chosen.states, found.strings, found.held_out) == (2, 95, 32)
    assert found.chosen.raw_states >= 2
    assert tuple(told) == found.training.curve
    assert (
        f"q = {found.chosen.intervals}, {found.chosen.raw_states} cells, 2 states after minimisation" in found.summary
    )
    assert found.chosen.agreement == 1.0
    assert "agreement: 100.0% of the held-out strings (32 strings)" in found.summary


def test_of_automata_that_are_right_and_equally_small_the_tightest_is_taken() -> None:
    even, words = parity(), ["", "0", "1", "00", "000", "01"]
    # Once a 1 came, all is rejected: only words with two of them would tell the two languages apart.
    never = replace(even, recurrent=[[[LARGE]], [[0.0]]])
    tree = PrefixTree.of(Strings.of(words, ["1" not in word for word in words]))
    found = [TrainedNetwork(network, k, 0.0, consistent=True) for k, network in enumerate((even, even, never))]
    chosen, (extract,) = _acceptor(found, tree, None, ExtractionSettings())
    assert chosen.network is never
    assert (extract.wrong, extract.states) == (0.0, 2)


PREDICTION = InferenceSettings(training=TrainingSettings(restarts=8, steps=800), finalists=2)


@pytest.fixture(scope="module")
def walks():
    return infer(WALKS, PREDICTION)


def test_walks_give_a_machine_that_says_what_may_come_next(walks) -> None:
    machine = walks.machine
    assert machine.kind is Kind.MOORE
    assert walks.consistent is None
    word = [machine.symbol(name) for name in "abc"]
    assert machine.output_of(word[:1]) == ("b",)
    assert machine.output_of(word[:2]) == ("c",)
    assert machine.output_of(word) == ("b", END)
    assert (walks.strings, walks.held_out) == (288, 72)


def test_the_report_has_all_q_and_a_picture(walks) -> None:
    assert [extract.intervals for extract in walks.extracts] == list(range(2, 21))
    assert walks.chosen.cost == min(extract.cost for extract in walks.extracts)
    assert walks.hidden.shape == (len(walks.cells), 2)
    assert set(walks.cells) <= set(range(walks.chosen.raw_states))
    beside = ", ".join(f"last {count} {walks.beside[f'last {count}']:.4f}" for count in range(4))
    assert f"on 72 held-out strings: {walks.chosen.loss:.4f} nats a symbol; {beside}" in walks.summary
    # No orphan states, and each says what it stands for.
    assert walks.machine.reachable() == tuple(range(walks.chosen.states))
    assert all(" > " in name for name in walks.machine.names)


def test_prediction_needs_something_to_judge_by() -> None:
    with pytest.raises(ConfigurationError, match=r"inference\.held_out"):
        infer(WALKS, InferenceSettings(held_out=0.0))
