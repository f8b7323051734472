"""A touch model learned in ``blind`` on the Zebra Zero as the beginning elsewhere, beside a beginning from nothing.

    python -m benchmarks.transfer --seeds 10 --jobs 2 --out transfer.jsonl --picture docs/images/transfer.png

One line a seed goes to ``--out`` as soon as it is there, and a second call goes on where the first was ended. Times are
seconds of exploration; a failure counts 20.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.belief import FAILED_S
from benchmarks.seeds import run_seeds
from palpate.adapters.config import RunConfig, scenario
from palpate.adapters.experiments import build_perception, build_task, learning_policy, run_scored_trial
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.policy import learner_of
from palpate.core.trial import find_ready_pose

WORLDS = {
    "ur5": ("blind", "ur5"),
    "tight": ("blind-tight", "zebra-zero"),
    "tilt 4 mrad": ("blind-tilt-4", "zebra-zero"),
}
FIRST_SEED = 2200
LEARNED, TRIALS = 10, 15


def trained(config: RunConfig, state: dict[str, Any] | None, trials: int) -> tuple[list[float], dict[str, Any]]:
    """Times of so many trials, and what was learned after them."""
    ready, perception = find_ready_pose(config.arm, config.task), build_perception(config)
    policy = learning_policy(config, perception)
    learner = learner_of(policy)
    if learner is None:
        raise SystemExit("nothing learns")
    if state is not None:
        learner.set_state(state)
    task, times = build_task(config, ready, perception, policy), []
    with SimulatedRig(config, ready) as rig:
        for trial in range(trials):
            scored = run_scored_trial(config, rig, task, trial)
            times.append(round(scored.report.exploration_time_s, 4) if scored.success else FAILED_S)
    return times, learner.get_state()


def run(seed: int) -> dict[str, Any]:
    """One seed: each other world from nothing, and from what ten trials in ``blind`` taught."""
    _, state = trained(replace(scenario("blind", "belief"), seed=seed), None, LEARNED)
    found: dict[str, Any] = {"seed": seed}
    for name, (preset, arm) in WORLDS.items():
        config = replace(scenario(preset, "belief"), arm=arm, seed=seed + 5000)
        found[name] = [trained(config, begin, TRIALS)[0] for begin in (None, state)]
    return found


def draw(done: list[dict[str, Any]], path: Path) -> None:
    """Mean over seeds, trial by trial."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.2), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    for axes, name in zip(figure.subplots(1, len(WORLDS), sharey=True), WORLDS, strict=True):
        for row, (label, colour) in enumerate((("from nothing", "#4878a8"), ("from blind, Zebra Zero", "#d55e00"))):
            times = np.array([seed[name][row] for seed in done])
            axes.plot(1 + np.arange(TRIALS), times.mean(axis=0), "o-", color=colour, markersize=3, label=label)
        axes.set(title=name, xlabel="trial", yscale="log")
        axes.set_yticks([0.3, 0.5, 1.0, 2.0, 5.0, 10.0], ["0.3", "0.5", "1", "2", "5", "10"])
        axes.minorticks_off()
        axes.grid(alpha=0.25)
    figure.axes[0].set_ylabel("exploration [s]")
    figure.axes[0].legend(frameon=False)
    figure.savefig(path, metadata={"Software": None})


def main() -> None:
    done, picture = run_seeds(__doc__, run, FIRST_SEED)
    print("| world | begins | trial 1, s | trials 2-5, s | trials 6-15, s | failed |\n|---|---|---|---|---|---|")
    for name in WORLDS:
        for row, label in enumerate(("from nothing", "from `blind`")):
            times = np.array([seed[name][row] for seed in done])
            means = (times[:, 0].mean(), times[:, 1:5].mean(), times[:, 5:].mean())
            cells = " | ".join(f"{mean:.2f}" for mean in means)
            print(f"| {name} | {label} | {cells} | {int((times >= FAILED_S).sum())} of {times.size} |")
    if picture is not None:
        draw(done, picture)


if __name__ == "__main__":
    main()
