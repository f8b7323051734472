"""Draws the mutants, the same ones for two checkouts."""

from __future__ import annotations

import ast
import difflib
import hashlib
import random
from dataclasses import dataclass
from pathlib import Path

from benchmarks.mutants.functions import Function, functions_in, functions_of, normalised, unique
from benchmarks.mutants.operators import places

_TRIES = 20


@dataclass(frozen=True)
class Mutant:
    """One small change of one function, wherever that stands.

    Attributes:
        id: The same for the same change.
        name: Of the function, with its classes.
        text: Of the function, normalised: by name and text it is found again.
        operator: Kind of the change.
        place: Counts the places for this operator in the function.
        variant: Counts the changes that there are at this place.
    """

    id: str
    name: str
    text: str
    operator: str
    place: int
    variant: int


@dataclass(frozen=True)
class Mutated:
    """A mutant's whole file; ``diff`` is what differs, ``line`` where the function's definition begins."""

    file: str
    line: int
    source: str
    diff: str


def draw(before: Path, after: Path, count: int, seed: int) -> list[Mutant]:
    """Mutants of functions that both checkouts have, word for word.

    Functions come in an order that only the seed and their own text give. One that a later checkout changes is so
    replaced by the next in line, and all others stay.
    """
    ours, theirs = unique(functions_of(before)), unique(functions_of(after))
    drawn: list[Mutant] = []
    for key in sorted(ours.keys() & theirs.keys(), key=lambda key: _digest(str(seed), *key)):
        if len(drawn) == count:
            return drawn
        mutant = _mutant(ours[key], before, seed)
        if mutant is not None and mutated(mutant, theirs[key], _source(after, theirs[key])) is not None:
            drawn.append(mutant)
    raise SystemExit(f"{len(drawn)} functions can be mutated, {count} are asked for")


def _mutant(function: Function, checkout: Path, seed: int) -> Mutant | None:
    """One mutation of a function, drawn by the seed; None where nothing in it can be changed."""
    generator = random.Random(_digest(str(seed), *function.key))
    found, source = places(function.node), _source(checkout, function)
    for _ in range(_TRIES if found else 0):
        operator = generator.choice(sorted(found))
        place = generator.randrange(len(found[operator]))
        variant = generator.randrange(len(found[operator][place].variants))
        numbers = operator, str(place), str(variant)
        mutant = Mutant(_digest(*function.key, *numbers)[:10], *function.key, operator, place, variant)
        if mutated(mutant, function, source) is not None:
            return mutant
    return None


def mutated(mutant: Mutant, function: Function, source: str) -> Mutated | None:
    """The mutant in the file where its function stands now; None if that is no Python or the same as before."""
    text = places(function.node)[mutant.operator][mutant.place].applied(source, mutant.variant)
    try:
        ast.parse(text)
    except SyntaxError:
        return None
    # The function itself has to differ, not only its layout.
    if mutant.text in {normalised(other.node) for other in functions_in(text, function.file) if _same(other, function)}:
        return None
    lines = difflib.unified_diff(source.splitlines(), text.splitlines(), function.file, function.file, "", "", 0, "")
    return Mutated(function.file, function.node.lineno, text, "\n".join(lines))


def _same(one: Function, other: Function) -> bool:
    return one.name == other.name and one.node.lineno == other.node.lineno


def _source(checkout: Path, function: Function) -> str:
    return (checkout / function.file).read_text(encoding="utf-8")


def _digest(*texts: str) -> str:
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()
