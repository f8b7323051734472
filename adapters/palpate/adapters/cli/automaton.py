"""``palpate automaton``: look at automata, hold them against each other, make them small."""

import sys
from collections.abc import Callable
from pathlib import Path

from palpate.adapters.cli.automaton_options import CompareAutomataOptions, MinimiseOptions, ShowAutomatonOptions
from palpate.adapters.log import aligned
from palpate.adapters.visualisation import machine_picture
from palpate.core.automata import Kind, Machine, difference, load, minimised, shown_output, to_dot_text, to_json_text
from palpate.core.errors import ConfigurationError
from palpate.core.ports import new_file, require_no_file


def show(options: ShowAutomatonOptions) -> int:
    """Print an automaton, write it as DOT, or draw it."""
    machine = read_automaton(options.file)
    if options.out:
        write_automaton(machine, Path(options.out))
        sys.stdout.write(f"{_size(machine)}; saved in {options.out}\n")
    else:
        sys.stdout.write(described(machine))
    return 0


def compare(options: CompareAutomataOptions) -> int:
    """Hold two automata against each other; 0 if they answer every word alike, else 1."""
    one, other = read_automaton(options.one), read_automaton(options.other)
    found = difference(one, other)
    if found is None:
        sys.stdout.write(f"they answer every word alike ({_size(one)}; {_size(other)})\n")
        return 0
    sys.stdout.write(f"they differ, first in {found}\n")
    return 1


def minimise(options: MinimiseOptions) -> int:
    """Write the smallest automaton that answers every word alike."""
    machine = read_automaton(options.file)
    source = Path(options.file)
    out = Path(options.out) if options.out else source.with_name(f"{source.stem}.minimal.json")
    small = minimised(machine)
    write_automaton(small, out)
    sys.stdout.write(f"{_size(machine)} before, {_size(small)} now; saved in {out}\n")
    return 0


def read_automaton(path: str) -> Machine:
    """Read an automaton."""
    if path.endswith(".dot"):
        accepted = "the automaton's .json file: DOT is written for Graphviz and not read back"
        raise ConfigurationError("automaton", path, accepted)
    return load(path)


def write_automaton(machine: Machine, path: Path) -> None:
    """Write an automaton, or draw it, by the ending of the file's name."""
    makers: dict[str, Callable[[], bytes]] = {
        ".json": lambda: to_json_text(machine).encode(),
        ".dot": lambda: to_dot_text(machine).encode(),
        ".svg": lambda: machine_picture(machine, path.stem, "svg"),
        ".png": lambda: machine_picture(machine, path.stem, "png"),
    }
    if path.suffix not in makers:
        raise ConfigurationError("out", str(path), f"a name that ends in one of {', '.join(makers)}")
    require_no_file(path)
    content = makers[path.suffix]()
    with new_file(path) as passing:
        passing.write_bytes(content)


def described(machine: Machine) -> str:
    """A table of states: output, and where each symbol leads."""
    names = machine.names
    head = ["state", *([] if machine.kind is Kind.MEALY else ["output"]), *machine.alphabet]
    rows = [head]
    for state, row in enumerate(machine.transitions):
        name = f"{names[state]} (start)" if state == machine.start else names[state]
        output = [] if machine.kind is Kind.MEALY else [shown_output(machine.state_outputs[state])]
        rows.append([name, *output, *(_edge(machine, state, symbol, target) for symbol, target in enumerate(row))])
    return f"{_size(machine)}\n\n{aligned(rows)}"


def _edge(machine: Machine, state: int, symbol: int, target: int | None) -> str:
    if target is None:
        return "-"
    name = machine.names[target]
    if machine.kind is not Kind.MEALY:
        return name
    output = machine.edge_outputs[state][symbol]
    return name if output is None else f"{name} / {shown_output(output)}"


def _size(machine: Machine) -> str:
    states, known = len(machine.transitions), "" if machine.complete else ", incomplete"
    known = f", {len(machine.actions)} actions{known}" if machine.actions else known
    return f"{machine.kind.value}, {states} state{'s' * (states != 1)}, {len(machine.symbols)} symbols{known}"
