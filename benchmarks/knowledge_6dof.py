"""Programmed skills whose choice is learned, in six degrees of freedom, and what is carried over from shape to shape.

    python -m benchmarks.knowledge_6dof --seeds 10 --jobs 2 --out knowledge.jsonl --picture knowledge_6dof.png

For each shape the learner begins as it does by default, with the skills that the rule takes ahead of all others, and
from nothing; then, of those from nothing, from what it learned of a round peg, and from all shapes before, in the order
round, square, triangle, hexagon. The triangle begins from the square that was learned by default, too. Beside them is
the rule itself, in as many trials of the same world: holes are anywhere within 3 mm, turned by up to 5 degrees, in a
plate that leans by 17.5 mrad, the grip by 4. The supervisor is on; a trip ends a trial and no more. One line a seed
goes to ``--out`` as soon as it is there, and a second call goes on where the first was ended.
Times are seconds of exploration; a failure counts 20.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from benchmarks.belief import FAILED_S
from benchmarks.insertion_6dof import config_of, trials
from benchmarks.seeds import run_seeds
from palpate.adapters.config import LEARNERS, RunConfig, overlay
from palpate.adapters.experiments import (
    build_perception,
    build_task,
    learning_policy,
    ready_pose,
    run_scored_trial,
    supervisor_of,
)
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.errors import DeviceError
from palpate.core.policy import learner_of

SHAPES = ("square", "triangle", "hexagon")
COLOURS = {
    "the rule": "#000000", "nothing": "#4878a8", "round": "#d55e00", "square": "#cc79a7", "all before": "#009e73",
}  # fmt: skip
FIRST_SEED = 4700
NEW, CARRIED = 30, 15
"""Trials from nothing, and with what is carried over."""
WARM = 0.3
"""Temperature with which the latter begin."""

FROM_NOTHING = {"rule_lead": 0.0}
"""No skill is ahead of another."""

State: TypeAlias = dict[str, Any]
Table: TypeAlias = dict[str, float]
Trial: TypeAlias = tuple[float, float]


def config(shape: str, seed: int, learning: Table) -> RunConfig:
    """The world that is asked, for this learner; a round peg has the corners of its rim."""
    found = config_of(shape, "asked", "zebra-zero", {"corner_mm": 14.5} if shape == "round" else {})
    if shape == "round":
        turned = {"hole_uncertainty_mm": 3.0, "conditions": {"plate_lean_mrad": 17.5}}
        found = overlay(found, {"cell": turned, "task": {"area_half_width_mm": 11.0}})
    return overlay(overlay(found, LEARNERS["skills"]), {"learner": "skills", "seed": seed, "learning": learning})


def by_rule(shape: str, seed: int) -> list[Trial]:
    """The same of the programmed rule, which learns nothing."""
    rows = trials(config_of(shape, "asked", "zebra-zero", {}), "corner-first", seed, range(NEW))
    return [(round(time_s if good else FAILED_S, 3), round(force_N, 2)) for _, _, good, time_s, force_N, *_ in rows]


def trained(shape: str, seed: int, begin: State | None, learning: Table = FROM_NOTHING) -> tuple[list[Trial], State]:
    """Time and true peak force of each trial, and what was learned after them."""
    told = config(shape, seed, learning if begin is None else {"temperature": WARM})
    ready, perception = ready_pose(told), build_perception(told)
    policy = learning_policy(told, perception)
    learner = learner_of(policy)
    if learner is None:
        raise SystemExit("nothing learns")
    if begin is not None:
        learner.set_state(begin)
    task, found = build_task(told, ready, perception, policy), []
    with SimulatedRig(told, ready) as rig:
        supervisor = supervisor_of(rig, told, ready)
        for trial in range(NEW if begin is None else CARRIED):
            try:
                scored = run_scored_trial(told, rig, task, trial, supervisor=supervisor)
            except DeviceError:
                found.append((FAILED_S, 0.0))
                continue
            if supervisor.trip is not None:
                rig.latch.acknowledge("benchmark", "the next trial begins anew")
            force_N = 0.0 if scored.truth is None else scored.truth.peak_force_N
            time_s = scored.report.exploration_time_s if scored.success else FAILED_S
            found.append((round(time_s, 3), round(force_N, 2)))
    return found, learner.get_state()


def run(seed: int) -> dict[str, Any]:
    """One seed: all shapes, from each beginning."""
    found: dict[str, Any] = {"seed": seed}
    found["round from nothing"], of_round = trained("round", seed, None)
    before, by_default = of_round, {}
    for number, shape in enumerate(SHAPES, start=1):
        own = seed + 10_000 * number
        found[f"{shape} by the rule"] = by_rule(shape, own)
        found[f"{shape} from the rule"], by_default[shape] = trained(shape, own, None, {})
        found[f"{shape} from nothing"], _ = trained(shape, own, None)
        found[f"{shape} from round"], after = trained(shape, own, of_round)
        if shape == "triangle":
            found["triangle from square"], _ = trained(shape, own, by_default["square"])
        if shape != "square":
            found[f"{shape} from all before"], after = trained(shape, own, before)
        before = after
    return found


def columns(done: Sequence[dict[str, Any]], name: str, part: int) -> npt.NDArray[np.float64]:
    """Times or forces of all seeds, (seeds, trials)."""
    return np.array([[trial[part] for trial in seed[name]] for seed in done])


def table(done: Sequence[dict[str, Any]]) -> None:
    print("| shape | learner | trial 1, s | 2-5 | 6-10 | 11-15 | last ten: in, median / p95, s | peak, N | failed |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name in (key for key in done[0] if key != "seed"):
        times, forces = columns(done, name, 0), columns(done, name, 1)
        last = times[:, -10:]
        means = (times[:, :1], times[:, 1:5], times[:, 5:10], times[:, 10:15])
        shape, _, beginning = name.partition(" ")
        print(
            f"| {shape} | {beginning} | {' | '.join(f'{part.mean():.2f}' for part in means)} | "
            f"{int((last < FAILED_S).sum())} of {last.size}, {np.median(last):.2f} / {np.quantile(last, 0.95):.2f} | "
            f"{forces.max():.1f} | {int((times >= FAILED_S).sum())} of {times.size} |"
        )


def draw(done: Sequence[dict[str, Any]], path: Path) -> None:
    """Mean over seeds, trial by trial."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.2), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    for axes, shape in zip(figure.subplots(1, len(SHAPES), sharey=True), SHAPES, strict=True):
        for beginning, colour in COLOURS.items():
            if (name := f"{shape} from {beginning}") in done[0]:
                times = columns(done, name, 0).mean(axis=0)
                axes.plot(1 + np.arange(times.size), times, "o-", color=colour, markersize=3, label=beginning)
        mean_s = float(columns(done, f"{shape} by the rule", 0).mean())
        axes.axhline(mean_s, color=COLOURS["the rule"], linestyle="--", linewidth=1, label="rule alone")
        axes.set(title=shape, xlabel="trial", yscale="log")
        axes.set_yticks([2.0, 3.0, 5.0, 10.0, 20.0], ["2", "3", "5", "10", "20"])
        axes.minorticks_off()
        axes.grid(alpha=0.25)
    figure.axes[0].set_ylabel("exploration [s]")
    figure.axes[1].legend(frameon=False, title="begins from")
    figure.savefig(path, metadata={"Software": None})


def main() -> None:
    done, picture = run_seeds(__doc__, run, FIRST_SEED)
    table(done)
    if picture is not None:
        draw(done, picture)


if __name__ == "__main__":
    main()
