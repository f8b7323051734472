"""The ``palpate explore`` command."""

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from palpate.adapters.cli.options import ExploreOptions
from palpate.adapters.cli.progress import progress
from palpate.adapters.experiments import save_policy
from palpate.adapters.experiments.grid import (
    LearningRun,
    Panel,
    Score,
    bounds_of,
    grid_named,
    inferred,
    learn,
    learning_figure,
    score_table,
    states_named,
    summary,
    trials_csv,
)
from palpate.adapters.files import new_file, new_folder, require_free_folder, require_no_file
from palpate.adapters.log import write_strings
from palpate.core.errors import UsageError
from palpate.core.perception import StateIdentifier, stage_to_dict
from palpate.core.policy import document_of
from palpate.simulation.grid import GridMap, walk_strings


def explore(options: ExploreOptions) -> int:
    """Learn in a grid world, draw the paper's figure, or write random walks to a file; return the exit code."""
    if sum(map(bool, (options.figure, options.strings, options.out))) > 1:
        raise UsageError("palpate explore does one of --figure, --strings and --out at a time")
    if options.strings:
        return _strings(options, Path(options.strings))
    if options.figure:
        return _figure(options, Path(options.figure))
    return _learn(options)


def _learn(options: ExploreOptions) -> int:
    grid = grid_named(options.map, options.size)
    states = states_named(options.state, grid)
    if options.out:
        require_free_folder(Path(options.out))
    runs = _runs(options, grid, states)
    if not runs:
        return 130
    title = f"map {options.map}, {len(grid.cells)} cells; states: {options.state}, {len(states.states)}; "
    title += f"{options.learning.learner}, {options.trials} trials"
    text = f"{title}\n\n{_table(options, grid, runs)}"
    sys.stdout.write(text)
    if options.out:
        with new_folder(Path(options.out)) as folder:
            _write(folder, options, grid, runs, text)
        sys.stdout.write(f"saved in {options.out}\n")
    return 0 if len(runs) == options.seeds else 130


def _runs(options: ExploreOptions, grid: GridMap, states: StateIdentifier, title: str = "") -> list[LearningRun]:
    """Learn once per seed, showing a progress bar; return the runs that finished, even after Ctrl-C."""
    runs: list[LearningRun] = []
    seeds = range(options.seed, options.seed + options.seeds)
    with progress(len(seeds) * options.trials, "trial", title) as bar:
        try:
            for seed in seeds:
                runs.append(learn(grid, states, options.learning, seed, options.trials, lambda walk: bar.update()))
        except KeyboardInterrupt:
            sys.stderr.write(f"\npalpate: ended early, after {len(runs)} of {len(seeds)} runs\n")
    return runs


def _table(options: ExploreOptions, grid: GridMap, runs: Sequence[LearningRun]) -> str:
    bounds = bounds_of(grid, options.learning.step_limit)
    return score_table([Score.of(run) for run in runs], bounds, options.trials)


def _panel(options: ExploreOptions, grid: GridMap, runs: Sequence[LearningRun], title: str) -> Panel:
    curves = tuple(tuple(run.steps) for run in runs)
    return Panel(title, curves, bounds_of(grid, options.learning.step_limit))


def _write(folder: Path, options: ExploreOptions, grid: GridMap, runs: Sequence[LearningRun], text: str) -> None:
    from palpate.adapters.log import made_with

    rows = list(grid.rows)
    for run in runs:
        world = {"grid": rows, "identifier": stage_to_dict(run.identifier)}
        document = document_of(run.learner, created_with=made_with(), perception=world)
        save_policy(document, folder / f"policy-{run.seed}.json")
    panel = _panel(options, grid, runs, f"map {options.map}, {options.learning.learner}; states: {options.state}")
    bounds = bounds_of(grid, options.learning.step_limit)
    settings = {"map": rows, "state": options.state, "trials": options.trials, "learning": asdict(options.learning)}
    whole = {"settings": settings, "made_with": made_with(), **summary([Score.of(run) for run in runs], bounds)}
    files = {
        "trials.csv": trials_csv(grid, runs),
        "table.txt": text,
        "summary.json": json.dumps(whole, indent=1, ensure_ascii=False) + "\n",
    }
    for name, content in files.items():
        (folder / name).write_text(content, encoding="utf-8", newline="\n")
    (folder / "learning_curve.png").write_bytes(learning_figure([[panel]], "png"))


def _figure(options: ExploreOptions, path: Path) -> int:
    from palpate.adapters.log import figure_kind

    kind = figure_kind(path, "figure")
    require_no_file(path)
    panels: list[list[Panel]] = []
    for number in ("1", "2"):
        grid = grid_named(number, options.size)
        sys.stderr.write(f"scenario {number}: inferring an automaton from {options.walks} random walks\n")
        automaton = inferred(grid, options.seed, options.walks, options.longest)
        panels.append([])
        for name, states in (("symbols only", states_named("symbols", grid)), ("automaton", automaton)):
            runs = _runs(options, grid, states, f"scenario {number}, {name}")
            if len(runs) < options.seeds:
                return 130
            title = f"scenario {number}, {name} ({len(states.states)} states)"
            sys.stdout.write(f"\n{title}\n{_table(options, grid, runs)}")
            panels[-1].append(_panel(options, grid, runs, title))
    with new_file(path) as file:
        file.write_bytes(learning_figure(panels, kind))
    sys.stdout.write(f"\nsaved as {path}\n")
    return 0


def _strings(options: ExploreOptions, path: Path) -> int:
    require_no_file(path)
    grid = grid_named(options.map, options.size)
    strings = walk_strings(grid, options.walks, options.seed, options.longest)
    with new_file(path) as file:
        write_strings(strings, file)
    sys.stdout.write(f"{len(strings.words)} walks, {strings.symbols} symbols, saved as {path}\n")
    return 0
