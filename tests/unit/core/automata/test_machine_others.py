"""AALpy and automata-lib find the same minimal machines and the same differences."""

import random

import pytest

from palpate.core.automata.machine import Kind
from palpate.core.automata.minimise import difference
from tests.unit.core.automata.machines import KINDS, random_machine
from tests.unit.core.automata.others import (
    SORTS,
    CrossCheck,
    from_aalpy,
    from_automata_lib,
    pair,
    to_aalpy,
    to_automata_lib,
)

PAIRS = {sort: 10 if sort == "large" else 80 for sort in SORTS}


@pytest.mark.parametrize("sort", SORTS)
def test_all_agree(sort):
    rng, check = random.Random(sort), CrossCheck()
    for _ in range(PAIRS[sort]):
        one, other = pair(rng, sort)
        check.machine(one)
        check.pair(one, other)
    assert check.disagreements == []


@pytest.mark.parametrize("sort", SORTS)
def test_the_pairs_are_what_they_are_called(sort):
    rng = random.Random(sort)
    found = [difference(*pair(rng, sort)) for _ in range(PAIRS[sort])]
    if sort == "every state twice":
        assert set(found) == {None}
    elif sort == "differ on the empty word only":
        assert {None if difference is None else difference.word for difference in found} == {()}
    else:
        assert any(found)


@pytest.mark.parametrize("kind", KINDS)
def test_machines_survive_the_way_there_and_back(kind):
    rng = random.Random(1)
    for _ in range(20):
        machine = random_machine(rng, kind, 6, 2, missing=0.2)
        assert difference(from_aalpy(to_aalpy(machine), machine), machine) is None
        if kind is Kind.DFA:
            assert from_automata_lib(to_automata_lib(machine), machine.alphabet) == machine


def test_a_wrong_answer_would_be_seen(monkeypatch):
    monkeypatch.setattr("tests.unit.core.automata.others.minimised", lambda machine: machine)
    monkeypatch.setattr("tests.unit.core.automata.others.difference", lambda one, other: None)
    rng, check = random.Random(1), CrossCheck()
    for _ in range(20):
        one, other = pair(rng, "two random")
        check.machine(one)
        check.pair(one, other)
    whats = {line.partition(":")[0] for line in check.disagreements}
    assert whats >= {
        "minimal machine, AALpy",
        "equality, AALpy",
        "minimal machine, automata-lib",
        "equality, automata-lib",
    }
