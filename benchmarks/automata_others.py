"""The same machines in AALpy and automata-lib, and what they say about them."""

import random
from collections.abc import Callable
from dataclasses import replace
from time import perf_counter
from typing import TypeVar

from aalpy.automata import Dfa, DfaState, MealyMachine, MealyState, MooreMachine, MooreState
from aalpy.utils import bisimilar
from automata.fa.dfa import DFA

from palpate.core.automata import Kind, Machine, difference, minimised
from tests.unit.core.automata.machines import canonical, doubled, random_machine

Result = TypeVar("Result")
SORTS = ("two random", "one state", "every state twice", "differ on the empty word only", "large")


def to_aalpy(machine: Machine) -> Dfa | MooreMachine | MealyMachine:
    """Reachable states, the start first: its minimisation neither drops the others nor keeps the start elsewhere."""
    makers = {
        Kind.DFA: lambda state: DfaState(f"q{state}", machine.state_outputs[state]),
        Kind.MOORE: lambda state: MooreState(f"q{state}", machine.state_outputs[state]),
        Kind.MEALY: lambda state: MealyState(f"q{state}"),
    }
    states = {state: makers[machine.kind](state) for state in machine.reachable()}
    for number, state in states.items():
        for symbol, target in zip(machine.alphabet, machine.transitions[number], strict=True):
            if target is not None:
                state.transitions[symbol] = states[target]
                if machine.kind is Kind.MEALY:
                    state.output_fun[symbol] = machine.edge_outputs[number][machine.symbol(symbol)]
    model = {Kind.DFA: Dfa, Kind.MOORE: MooreMachine, Kind.MEALY: MealyMachine}[machine.kind]
    return model(states[machine.start], list(states.values()))


def from_aalpy(model: Dfa | MooreMachine | MealyMachine, like: Machine) -> Machine:
    number = {state: index for index, state in enumerate(model.states)}
    rows = [[state.transitions.get(symbol) for symbol in like.alphabet] for state in model.states]
    mealy = like.kind is Kind.MEALY
    return Machine(
        like.kind,
        like.alphabet,
        tuple(tuple(None if target is None else number[target] for target in row) for row in rows),
        () if mealy else tuple(state.output for state in model.states),
        tuple(tuple(state.output_fun.get(symbol) for symbol in like.alphabet) for state in model.states)
        if mealy
        else (),
        number[model.initial_state],
    )


def to_automata_lib(machine: Machine) -> DFA:
    """A DFA; where nothing is known it rejects."""
    return DFA(
        states=set(range(len(machine.transitions))),
        input_symbols=set(machine.alphabet),
        transitions={
            state: {name: target for name, target in zip(machine.alphabet, row, strict=True) if target is not None}
            for state, row in enumerate(machine.transitions)
        },
        initial_state=machine.start,
        final_states={state for state, accepts in enumerate(machine.state_outputs) if accepts},
        allow_partial=not machine.complete,
    )


def from_automata_lib(found: DFA, alphabet: tuple[str, ...]) -> Machine:
    states = sorted(found.states)
    number = {state: index for index, state in enumerate(states)}
    rows = tuple(tuple(number.get(found.transitions[state].get(name)) for name in alphabet) for state in states)
    accepts = tuple(state in found.final_states for state in states)
    return Machine(Kind.DFA, alphabet, rows, accepts, start=number[found.initial_state])


def pair(rng: random.Random, sort: str) -> tuple[Machine, Machine]:
    """Two machines of one kind and alphabet; most have states that no word leads to, many are incomplete."""
    kind, symbols = rng.choice(list(Kind)), rng.randint(1, 3)
    if sort == "differ on the empty word only":
        kind = rng.choice([Kind.DFA, Kind.MOORE])
    states = {"one state": 1, "large": 30}.get(sort) or rng.randint(2, 8)
    missing = rng.choice([0.0, 0.0, 0.2, 0.5])
    one = random_machine(rng, kind, states, symbols, missing)
    if sort == "every state twice":
        return one, doubled(one, rng)
    if sort == "differ on the empty word only":
        first, second = (False, True) if kind is Kind.DFA else ("x", "y")
        return _with_new_start(one, first), _with_new_start(one, second)
    return one, random_machine(rng, kind, states, symbols, missing)


def _with_new_start(machine: Machine, output: bool | str) -> Machine:
    """The same answers but to the empty word."""
    return replace(
        machine,
        transitions=(*machine.transitions, machine.transitions[machine.start]),
        state_outputs=(*machine.state_outputs, output),
        start=len(machine.transitions),
    )


class CrossCheck:
    """Compares with both libraries, and adds up who took how long.

    Attributes:
        seconds: Total by task and program.
        disagreements: What was found, a line each.
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.disagreements: list[str] = []

    def machine(self, machine: Machine) -> None:
        """Minimises one machine with all."""
        # Neither library merges states of incomplete machines as ours does, so all get the same completion.
        full = machine.completed({Kind.DFA: False, Kind.MOORE: "new", Kind.MEALY: "new"}[machine.kind])
        mine = self._timed(f"minimise {machine.kind.value}, palpate", lambda: minimised(full))
        model = to_aalpy(full)
        self._timed(f"minimise {machine.kind.value}, AALpy", model.minimize)
        self._expect(canonical(from_aalpy(model, full)) == mine, "minimal machine, AALpy", machine)
        self._expect(difference(machine, minimised(machine)) is None, "minimal incomplete machine", machine)
        if machine.kind is Kind.DFA:
            # Given as it is; the library completes it by itself, and leaves its sink out of what it gives back.
            lib = to_automata_lib(machine)
            small = self._timed(f"minimise {machine.kind.value}, automata-lib", lib.minify)
            theirs = canonical(from_automata_lib(small, machine.alphabet).completed(False))
            self._expect(theirs == mine, "minimal machine, automata-lib", machine)

    def pair(self, one: Machine, other: Machine) -> None:
        """Compares two machines with all."""
        mine = self._timed(f"compare {one.kind.value}, palpate", lambda: difference(one, other))
        models = to_aalpy(one), to_aalpy(other)
        word = self._timed(f"compare {one.kind.value}, AALpy", lambda: bisimilar(*models, return_cex=True))
        # Its counterexample may be the empty word, which is not true.
        self._expect((mine is None) == (word is None), "equality, AALpy", one, other)
        if mine is not None and word is not None:
            # With incomplete machines, and not otherwise, it may overlook a shorter word.
            shortest = len(mine.word) == len(word) or not (one.complete and other.complete)
            self._expect(shortest and len(mine.word) <= len(word), "shortest word, AALpy", one, other)
        if one.kind is Kind.DFA:
            libs = to_automata_lib(one), to_automata_lib(other)
            same = self._timed(f"compare {one.kind.value}, automata-lib", lambda: libs[0] == libs[1])
            found = difference(one.completed(False), other.completed(False))
            self._expect(same == (found is None), "equality, automata-lib", one, other)

    def _timed(self, task: str, call: Callable[[], Result]) -> Result:
        begin = perf_counter()
        result = call()
        self.seconds[task] = self.seconds.get(task, 0.0) + perf_counter() - begin
        return result

    def _expect(self, right: bool, what: str, *machines: Machine) -> None:
        if not right:
            self.disagreements.append(f"{what}: {machines}")
