"""The ``palpate infer`` command, which infers, shows and compares automata."""

import json
import sys
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from palpate.adapters.cli.progress import progress
from palpate.adapters.experiments import load_automaton
from palpate.adapters.files import new_file, new_folder, require_free_folder, require_no_file
from palpate.adapters.log import aligned, counted, strings_from
from palpate.core import automata
from palpate.core.errors import ConfigurationError, UsageError
from palpate.core.ports import Settings


@dataclass(frozen=True)
class InferOptions(Settings):
    """Infer an automaton from symbol strings, with an Elman network and dynamic state partitioning.

    The strings come from a text file with one string per line, as written by palpate explore --strings, or from logs of
    insertion trials. Each trial that ended in the hole yields a string. Labelled strings yield an acceptor; strings
    without labels yield a machine whose outputs are the possible next symbols.
    """

    files: Annotated[tuple[str, ...], tyro.conf.Positional] = ()
    """A text file, or logs and folders with logs. With --show or --compare: automaton files (JSON)."""
    out: str = ""
    """New or empty folder for the automaton, the network and a report. With --show: a new Graphviz file (.dot)."""
    show: bool = False
    """Print an automaton instead of inferring one, or write it to --out."""
    compare: bool = False
    """Compare two automata instead of inferring one. Exit code 0: same outputs for every word; 1: different, and the
    shortest word with different outputs is printed."""
    settings: Annotated[automata.InferenceSettings, tyro.conf.arg(name="")] = field(
        default_factory=automata.InferenceSettings
    )


def infer(options: InferOptions) -> int:
    """Infer, report and save an automaton; return 0, or 2 if no network was consistent with the labelled strings."""
    if options.show and options.compare:
        raise UsageError("palpate infer takes --show or --compare, not both")
    if options.show:
        return _show(options)
    if options.compare:
        return _compare(options)
    if not options.out:
        raise UsageError("palpate infer needs --out, a folder for the result")
    out = Path(options.out)
    require_free_folder(out)
    strings = strings_from(options.files)
    training = options.settings.training
    with ExitStack() as opened:
        bars: list[Any] = []

        def show(point: automata.Progress) -> None:
            if not bars:
                # Shown only once training has begun, because settings may be rejected before then.
                total = training.restarts * training.steps
                bars.append(opened.enter_context(progress(total, "step", "training")))
            (bar,) = bars
            batch = min(training.batch, training.restarts - point.restart)
            bar.update(point.restart * training.steps + batch * point.step - bar.n)
            bar.set_postfix_str(f"lowest loss {point.best_loss:.4g}")

        found = automata.infer(strings, options.settings, progress=show)
    with new_folder(out) as folder:
        (folder / "automaton.json").write_text(automata.to_json_text(found.machine), encoding="utf-8")
        (folder / "automaton.dot").write_text(automata.to_dot_text(found.machine), encoding="utf-8")
        (folder / "network.json").write_text(automata.network_text(found.network.network), encoding="utf-8")
        (folder / "report.json").write_text(json.dumps(_report(found), indent=1) + "\n", encoding="utf-8")
    sys.stdout.write(
        f"{len(strings.words)} strings, {len(strings.alphabet)} symbols\n{found.summary}\nsaved in {out}\n"
    )
    if found.consistent is False:
        sys.stderr.write(
            f"palpate: no network is consistent with all {found.strings} training strings; the best is in"
            f" {out}: try more --training.restarts, more --hidden units or --order 2\n"
        )
        return 2
    return 0


def _report(found: automata.Inference) -> dict[str, object]:
    return {
        "strings": found.strings,
        "held_out": found.held_out,
        **_figures(found.chosen),
        "baselines": found.baselines,
        "networks": len(found.training.networks),
        "consistent_networks": found.training.consistent,
        "lowest_loss": found.training.best.loss,
        "by_q": [_figures(extract) for extract in found.extracts],
    }


def _figures(extract: Any) -> dict[str, object]:
    names = ("raw_states", "states", "wrong", "agreement", "loss")
    return {"q": extract.intervals, **{name: getattr(extract, name) for name in names}}


def _show(options: InferOptions) -> int:
    (machine,) = _automata(options.files, 1, "--show")
    if options.out:
        out = Path(options.out)
        options.require("out", out.suffix == ".dot", "a name that ends in .dot, with --show")
        require_no_file(out)
        with new_file(out) as passing:
            passing.write_text(automata.to_dot_text(machine), encoding="utf-8")
        sys.stdout.write(f"{_size(machine)}; saved in {out}\n")
    else:
        sys.stdout.write(f"{_size(machine)}\n\n{_table(machine)}")
    return 0


def _compare(options: InferOptions) -> int:
    if options.out:
        raise UsageError("palpate infer --compare writes nothing: leave out --out")
    one, other = _automata(options.files, 2, "--compare")
    found = automata.difference(one, other)
    if found is None:
        sys.stdout.write(f"they give the same output for every word ({_size(one)}; {_size(other)})\n")
        return 0
    sys.stdout.write(f"they differ, first in {found}\n")
    return 1


def _automata(files: tuple[str, ...], count: int, flag: str) -> list[automata.Machine]:
    if len(files) != count:
        raise UsageError(f"palpate infer {flag} needs {count} automaton file{'s' * (count > 1)} (got {len(files)})")
    for path in files:
        if path.endswith(".dot"):
            accepted = "the automaton's .json file: DOT is written for Graphviz and not read back"
            raise ConfigurationError("automaton", path, accepted)
    return [load_automaton(path) for path in files]


def _table(machine: automata.Machine) -> str:
    """Return the states with their outputs and transitions."""
    names = machine.names
    rows = [["state", "output", *machine.alphabet]]
    for state, row in enumerate(machine.transitions):
        name = f"{names[state]} (start)" if state == machine.start else names[state]
        targets = ("-" if target is None else names[target] for target in row)
        rows.append([name, automata.shown_output(machine.state_outputs[state]), *targets])
    return aligned(rows)


def _size(machine: automata.Machine) -> str:
    states, known = counted(len(machine.transitions), "state"), "" if machine.complete else ", incomplete"
    return f"{machine.kind.value}, {states}, {counted(len(machine.alphabet), 'symbol')}{known}"
