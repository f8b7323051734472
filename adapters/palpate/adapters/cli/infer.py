"""``palpate infer``."""

import json
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from palpate.adapters.cli.automaton_options import InferOptions
from palpate.adapters.cli.progress import progress
from palpate.adapters.log import strings_from
from palpate.adapters.visualisation import hidden_picture, machine_picture, training_picture
from palpate.core.automata import (
    NORMALISED,
    Inference,
    Progress,
    infer,
    save_network,
    to_dot_text,
    to_json_text,
)
from palpate.core.errors import UsageError
from palpate.core.ports import new_folder, require_free_folder


def infer_command(options: InferOptions) -> int:
    """Infer, report and save; 0, or 2 when no network became consistent with labelled strings."""
    if not options.out:
        raise UsageError("palpate infer needs --out, a folder for what comes of it")
    out = Path(options.out)
    require_free_folder(out)
    strings = strings_from(options.files, with_actions=options.with_actions)
    training = options.settings.training
    networks = training.networks(normalised=options.settings.activation == NORMALISED)
    with ExitStack() as opened:
        bars: list[Any] = []

        def show(point: Progress) -> None:
            if not bars:
                # Not before training really goes on: settings may still be refused.
                total = networks * training.steps
                bars.append(opened.enter_context(progress(total, "step", "training")))
            (bar,) = bars
            batch = min(training.batch, networks - point.restart)
            bar.update(point.restart * training.steps + batch * point.step - bar.n)
            bar.set_postfix_str(f"lowest loss {point.best_loss:.4g}")

        found = infer(strings, options.settings, progress=show)
    with new_folder(out) as folder:
        _save(found, folder)
    actions = f", {len(strings.actions)} actions" if strings.actions else ""
    sys.stdout.write(
        f"{len(strings.words)} strings, {len(strings.names)} symbols{actions}\n{found.summary}\nsaved in {out}\n"
    )
    if found.consistent is False:
        sys.stderr.write(
            f"palpate: no network became consistent with all {found.strings} training strings; the best is kept in"
            f" {out}: try more --training.restarts, more --hidden units or --order 2\n"
        )
        return 2
    return 0


def _save(found: Inference, folder: Path) -> None:
    machine = found.machine
    (folder / "automaton.json").write_text(to_json_text(machine), encoding="utf-8")
    (folder / "automaton.dot").write_text(to_dot_text(machine), encoding="utf-8")
    (folder / "automaton.svg").write_bytes(machine_picture(machine, f"q = {found.chosen.intervals}"))
    save_network(found.network.network, folder / "network.json")
    (folder / "report.json").write_text(json.dumps(_report(found), indent=1) + "\n", encoding="utf-8")
    (folder / "hidden.png").write_bytes(hidden_picture(found))
    (folder / "training.png").write_bytes(training_picture(found))


def _report(found: Inference) -> dict[str, object]:
    return {
        "strings": found.strings,
        "held_out": found.held_out,
        **_figures(found.chosen),
        "beside": found.beside,
        "networks": len(found.training.networks),
        "consistent_networks": found.training.consistent,
        "lowest_loss": found.training.best.loss,
        "by_q": [_figures(extract) for extract in found.extracts],
    }


def _figures(extract: Any) -> dict[str, object]:
    names = ("raw_states", "states", "wrong", "agreement", "loss")
    return {"q": extract.intervals, **{name: getattr(extract, name) for name in names}}
