"""``palpate explore``."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from palpate.adapters.cli.options import ExploreOptions
from palpate.adapters.cli.progress import progress
from palpate.adapters.experiments.grid import (
    LearningRun,
    Named,
    Panel,
    Score,
    StateMaker,
    bounds_of,
    grid_named,
    inferred,
    learn,
    learning_figure,
    score_table,
    summary,
    trials_csv,
)
from palpate.adapters.files import (
    new_file,
    new_folder,
    require_free_folder,
    require_no_file,
    save_policy,
    write_strings,
)
from palpate.core.errors import UsageError
from palpate.core.perception import stage_to_dict
from palpate.core.policy import document_of
from palpate.simulation.grid import GridMap, walk_strings


def explore(options: ExploreOptions) -> int:
    """Learn in a grid world, draw the paper's figure, or write down random walks; returns the exit code."""
    if sum(map(bool, (options.figure, options.strings, options.out))) > 1:
        raise UsageError("palpate explore does one of --figure, --strings and --out at a time")
    if options.strings:
        return _strings(options, Path(options.strings))
    if options.figure:
        return _figure(options, Path(options.figure))
    return _learn(options)


def _learn(options: ExploreOptions) -> int:
    grid, make = grid_named(options.map, options.size), Named(options.state)
    make(grid)
    if options.out:
        require_free_folder(Path(options.out))
    runs = _runs(options, grid, make)
    if not runs:
        return 130
    bounds = bounds_of(grid, options.learning.step_limit)
    scores = [Score.of(run) for run in runs]
    head = f"map {options.map}, {len(grid.cells)} cells; states: {options.state}, {len(runs[0].identifier.states)}; "
    head += f"{options.learning.learner}, {options.trials} trials\n\n"
    text = head + score_table(scores, bounds, options.trials)
    sys.stdout.write(text)
    if options.out:
        with new_folder(Path(options.out)) as folder:
            _write(folder, options, grid, runs, text, summary(scores, bounds))
        sys.stdout.write(f"saved in {options.out}\n")
    return 0 if len(runs) == options.seeds else 130


def _runs(options: ExploreOptions, grid: GridMap, make: StateMaker, title: str = "") -> list[LearningRun]:
    """The runs, under a progress bar; after Ctrl-C those that were finished."""
    runs: list[LearningRun] = []
    seeds = range(options.seed, options.seed + options.seeds)
    total = len(seeds) * options.trials
    with progress(total, "trial", title) as bar:
        try:
            for seed in seeds:
                runs.append(learn(grid, make, options.learning, seed, options.trials, lambda walk: bar.update()))
        except KeyboardInterrupt:
            sys.stderr.write(f"\npalpate: ended early, after {len(runs)} of {len(seeds)} runs\n")
    return runs


def _write(
    folder: Path,
    options: ExploreOptions,
    grid: GridMap,
    runs: Sequence[LearningRun],
    text: str,
    figures: dict[str, Any],
) -> None:
    from palpate.adapters.log import made_with

    learning = {name: getattr(options.learning, name) for name in options.learning.__dataclass_fields__}
    settings = {"map": list(grid.rows), "state": options.state, "trials": options.trials, "learning": learning}
    for run in runs:
        world = {"grid": list(grid.rows), "identifier": stage_to_dict(run.identifier)}
        document = document_of(run.learner, created_with=made_with(), perception=world)
        save_policy(document, folder / f"policy-{run.seed}.json")
    title = f"map {options.map}, {options.learning.learner}; states: {options.state}"
    curves = Panel(title, _curves(runs), bounds_of(grid, options.learning.step_limit))
    (folder / "trials.csv").write_text(trials_csv(grid, runs), encoding="utf-8", newline="\n")
    (folder / "table.txt").write_text(text, encoding="utf-8", newline="\n")
    (folder / "learning_curve.png").write_bytes(learning_figure([[curves]], "png"))
    whole = {"settings": settings, "made_with": made_with(), **figures}
    (folder / "summary.json").write_text(
        json.dumps(whole, indent=1, ensure_ascii=False) + "\n", encoding="utf-8", newline="\n"
    )


def _figure(options: ExploreOptions, path: Path) -> int:
    from palpate.adapters.log import figure_kind

    kind = figure_kind(path, "figure")
    require_no_file(path)
    panels: list[list[Panel]] = []
    for number in ("1", "2"):
        grid = grid_named(number, options.size)
        sys.stderr.write(f"scenario {number}: inferring an automaton from {options.walks} random walks\n")
        automaton = inferred(grid, options.seed, options.walks, options.longest)
        row = []
        for name, make in (("symbols only", Named()), ("automaton", automaton)):
            panel = _panel(options, grid, make, f"scenario {number}, {name}")
            if panel is None:
                return 130
            row.append(panel)
        panels.append(row)
    with new_file(path) as file:
        file.write_bytes(learning_figure(panels, kind))
    sys.stdout.write(f"\nsaved as {path}\n")
    return 0


def _panel(options: ExploreOptions, grid: GridMap, make: StateMaker, title: str) -> Panel | None:
    """A panel, of which the table is printed too; None after Ctrl-C."""
    runs = _runs(options, grid, make, title)
    if len(runs) < options.seeds:
        return None
    title += f" ({len(runs[0].identifier.states)} states)"
    bounds = bounds_of(grid, options.learning.step_limit)
    scores = [Score.of(run) for run in runs]
    sys.stdout.write(f"\n{title}\n{score_table(scores, bounds, options.trials)}")
    return Panel(title, _curves(runs), bounds)


def _strings(options: ExploreOptions, path: Path) -> int:
    require_no_file(path)
    grid = grid_named(options.map, options.size)
    strings = walk_strings(grid, options.walks, options.seed, options.longest)
    with new_file(path) as file:
        write_strings(strings, file)
    sys.stdout.write(f"{len(strings.words)} walks, {strings.symbols} symbols, saved as {path}\n")
    return 0


def _curves(runs: Sequence[LearningRun]) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(run.steps) for run in runs)
