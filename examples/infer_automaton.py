"""Infer an automaton from random walks, and use its states for learning.

In map 2, some cells have the same letter but require different moves, so the letter alone is not a sufficient state.
The script trains Elman networks on the letters of random walks and extracts an automaton. Q-learning then uses the
states of this automaton. For comparison, the same learner also runs with the letters alone.

The script prints a summary of the automaton and, for both kinds of state, the mean number of steps to the goal in the
last 100 trials: about 40 with letters, and far fewer with the automaton. It also prints the best possible number.

It takes a few minutes, or a few seconds with ``--quick``, which is too short for a good automaton.

The commands ``palpate explore --strings``, ``palpate infer`` and ``palpate explore --state`` do the same.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from palpate.adapters.config import GridLearning
from palpate.adapters.experiments.grid import (
    Panel,
    bounds_of,
    grid_named,
    learn,
    learning_figure,
)
from palpate.adapters.files import new_folder, require_free_folder
from palpate.core.automata import AutomatonState, InferenceSettings, TrainingSettings, infer, to_dot_text, to_json_text
from palpate.core.errors import PalpateError
from palpate.core.perception import IdentityState, StateIdentifier
from palpate.simulation.grid import walk_strings


def main() -> None:
    """Parse the command line, and run the script."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="use fewer walks, networks and trials")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("runs/automaton"), help="output folder; must be new or empty")
    options = parser.parse_args()
    walks, networks, steps, trials = (100, 4, 100, 200) if options.quick else (1000, 64, 500, 1500)
    try:
        training = TrainingSettings(restarts=networks, batch=networks, steps=steps, seed=options.seed)
        require_free_folder(options.out)
        grid = grid_named("2", 7)
        bounds = bounds_of(grid)
        strings = walk_strings(grid, walks, options.seed, longest=30)
        found = infer(strings, InferenceSettings(training=training))
        print(found.summary, flush=True)
        followed = AutomatonState.of(found.machine, strings, symbols=grid.symbols)
        kinds: dict[str, StateIdentifier] = {"letters": IdentityState(grid.symbols), "automaton": followed}
        panels = []
        for name, identifier in kinds.items():
            run = learn(grid, identifier, GridLearning(), options.seed, trials)
            last = run.steps[-100:]
            print(
                f"{name}: {len(run.identifier.states)} states, {sum(last) / len(last):.2f} steps in the last 100 trials"
            )
            panels.append(Panel(name, (tuple(run.steps),), bounds))
        print(f"best possible without knowing the place: {bounds.belief:.2f}; random walk: {bounds.random_walk:.1f}")
        with new_folder(options.out) as folder:
            (folder / "automaton.json").write_text(to_json_text(found.machine), encoding="utf-8")
            (folder / "automaton.dot").write_text(to_dot_text(found.machine), encoding="utf-8")
            (folder / "learning.png").write_bytes(learning_figure([panels], "png"))
    except (PalpateError, OSError) as error:
        parser.error(str(error))
    print(f"look at {options.out}/automaton.dot and {options.out}/learning.png")


if __name__ == "__main__":
    main()
