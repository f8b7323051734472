"""Memory files: what was learned comes back to the bit, and what does not fit is refused in a line."""

import json
from dataclasses import replace

import numpy as np
import pytest

from palpate.adapters.experiments.grid import believed, render_memory
from palpate.adapters.visualisation import memory_picture
from palpate.core.errors import ConfigurationError
from palpate.core.perception import IdentityState
from palpate.core.policy import MemoryLearner, MemoryParameters, PairsLearner
from palpate.core.policy.memory import MemoryDocument
from palpate.core.policy.memory.clone_fit import clones_of
from palpate.core.policy.memory.clone_model import CloneModel
from palpate.core.policy.memory.recorded import Batch
from palpate.simulation.grid import grid_actions, run_trial, walked_steps
from tests.unit.core.policy.memory.worlds import AMBIGUOUS, random_trials, small_automaton, true_offsets

WORLD = {"grid": list(AMBIGUOUS.rows)}
TRIALS = random_trials(AMBIGUOUS, 40)


def learner_of(kind: str):
    if kind == "pairs":
        pairs, identity = PairsLearner(AMBIGUOUS.symbols, grid_actions()), IdentityState(AMBIGUOUS.symbols)
        for trial in range(20):
            run_trial(AMBIGUOUS, identity, pairs, 0, trial)
        return pairs
    learner = MemoryLearner(AMBIGUOUS.symbols, grid_actions(), MemoryParameters(kind=kind.split()[0]))
    if kind == "offset":
        model = true_offsets(AMBIGUOUS).rounded()
    elif kind == "automaton":
        model = small_automaton()
    else:
        clones = clones_of(TRIALS, 3, 20)
        blank = CloneModel.blank(clones, 3, 8, np.random.default_rng(0))
        model = replace(blank, misread=0.05 * ("misread" in kind)).fitted(Batch.of(TRIALS), 3).rounded()
    learner.use([model], TRIALS)
    return learner


def document_of(kind: str) -> MemoryDocument:
    return MemoryDocument.of(learner_of(kind), created_with={}, world=WORLD)


@pytest.mark.parametrize("kind", ["offset", "clones", "clones that misread", "automaton", "pairs"])
def test_what_was_learned_comes_back_and_acts_alike(kind: str) -> None:
    document = document_of(kind)
    again = MemoryDocument.from_json_text(document.to_json_text())
    assert again.to_json_text() == document.to_json_text()
    identity = IdentityState(AMBIGUOUS.symbols)
    learned, read = learner_of(kind).as_frozen(), again.learner()
    assert walked_steps(AMBIGUOUS, identity, learned) == walked_steps(AMBIGUOUS, identity, read)
    assert read.get_state() == learned.get_state()


def test_pairs_of_an_older_file_act_by_their_values_and_go_on_as_they_did() -> None:
    content = json.loads(document_of("pairs").to_json_text())
    content["parameters"], tables = {}, content["state"]["tables"]
    for table in tables:
        table[3] = [-9.0] * 8
    told = MemoryDocument.from_json_text(json.dumps(content)).learner()
    for table in tables:
        del table[3]
    older = MemoryDocument.from_json_text(json.dumps(content)).learner(frozen=False)
    assert older.returned == 0.0
    past = next(tuple(table[0]) for table in tables if table[2][0] > 0)
    assert older.as_frozen().values(past) == older.values(past) != told.values(past)


def test_pairs_look_back_as_far_as_the_file_says() -> None:
    pairs = PairsLearner(AMBIGUOUS.symbols, grid_actions(), longest=6)
    run_trial(AMBIGUOUS, IdentityState(AMBIGUOUS.symbols), pairs, 0, 0)
    document = MemoryDocument.of(pairs, created_with={}, world=WORLD)
    assert document.learner().get_state() == pairs.get_state()


def require_refused_in_a_line(kind: str, path: tuple[str | int, ...], value: object, says: str) -> None:
    content = json.loads(document_of(kind).to_json_text())
    part = content
    for key in path[:-1]:
        part = part[key]
    part[path[-1]] = value
    with pytest.raises(ConfigurationError, match=says) as refused:
        MemoryDocument.from_json_text(json.dumps(content))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("path", "value", "says"),
    [
        (("models", 0, "emissions", 0, 0), float("nan"), "NaN"),
        (("models", 0, "emissions", 0, 0), -0.5, "finite probabilities"),
        (("models", 0, "blocked", 0, 0), 1.5, "probabilities from 0 to 1"),
        (("models", 0, "start"), [1.0], r"shape \(1,\)"),
        (("models", 0, "offsets", 0), [0, 0], "not the goal's"),
        (("displacements_mm", 1), [0.3, 0.77], "whole multiples of the shortest"),
        (("displacements_mm",), [[1.0, 0.0]], "8, one an action"),
        (("symbols",), ["A", "B"], "numbers from 0 to 1"),
        (("parameters", "reach"), 150, "more than 512 MB are not set aside"),
        (("state", "trials", 0, "actions"), [0, 1], "one for each of the 2 actions"),
    ],
)
def test_a_file_that_contradicts_itself_is_refused_in_a_line(path, value, says: str) -> None:
    require_refused_in_a_line("offset", path, value, says)


@pytest.mark.parametrize(
    ("path", "value", "says"),
    [
        (("targets", 0, 0, 0), 4, "numbers from -1 to 3"),
        (("targets", 0, 0, 0), 0.5, "whole numbers"),
        (("symbol_of", 0), 3, "numbers from -1 to 2"),
        (("shares", 0, 0, 0), -0.5, "probabilities"),
        (("jumps",), [[1.0]], r"shape \(1, 1\)|shape \(4, 1, 3\)"),
    ],
)
def test_an_automaton_that_contradicts_itself_is_refused_in_a_line(path, value, says: str) -> None:
    require_refused_in_a_line("automaton", ("models", 0, *path), value, says)


@pytest.mark.parametrize(
    ("name", "value", "says"), [("longest", 0, "from 1 to"), ("longest", "4", "whole|int"), ("returned", 1.5, "0 to 1")]
)
def test_settings_of_pairs_that_cannot_be_are_refused_in_a_line(name: str, value, says: str) -> None:
    require_refused_in_a_line("pairs", ("parameters", name), value, says)


@pytest.mark.parametrize(
    ("path", "value"),
    [((), [[0]]), ((), 3), ((0,), []), ((0,), [-1]), ((0,), [0, 1]), ((2, 0), -3), ((1,), [0.0])],
)
def test_a_table_of_pasts_that_cannot_be_is_refused_in_a_line(path, value) -> None:
    require_refused_in_a_line("pairs", ("state", "tables", 0, *path), value, "a value and a count")


def test_text_and_picture_show_what_is_read_where_and_the_belief() -> None:
    document = document_of("offset")
    text = render_memory(document, "A +x B")
    assert "A  B  A  C  B\nC  A     B  A\nB  C  ·  A  C\n" in text
    belief = believed(document, "A +x B")
    # Four places read B one step right of an A; from the start each is as likely as the other.
    assert sorted(belief[belief > 0.01].round(3)) == [0.25] * 4
    assert memory_picture(document, belief, "A +x B", "png").startswith(b"\x89PNG")
    assert b"along y, in steps" in memory_picture(document, belief, "A +x B", "svg")
    with pytest.raises(ConfigurationError, match="a file with a model"):
        believed(document_of("pairs"), "A")
    for words, says in (("A +x", "a symbol behind"), ("A A", "one of"), ("D", "one of A B C")):
        with pytest.raises(ConfigurationError, match=says):
            believed(document, words)
    with pytest.raises(ConfigurationError, match="no other is laid out"):
        memory_picture(document_of("clones"), belief, "", "png")
    assert "symbol  hidden states  belief" in render_memory(document_of("clones"))
    told = render_memory(document_of("automaton"), "A +x B")
    assert told.splitlines()[-3:] == [
        "A                   1    0.00",
        "B                   1    1.00",
        "C                   1    0.00",
    ]
    assert "pasts of one to 4 symbols" in render_memory(document_of("pairs"))
