"""One contact model on many arms: a belief from ten trials on the Zebra Zero, used on other arms and in other cells.

    python -m benchmarks.arms --trials 100 --jobs 2 --out arms.jsonl
    python -m benchmarks.arms --transfer --seeds 10 --trials 15 --jobs 2 --out transfer.jsonl

Without ``--transfer``, the policy is frozen and runs ``--trials`` trials on each arm, in blocks of ten. With it, the
learner is trained in other cells, both from scratch and after training in ``blind``. Times are exploration times in
seconds; a failure counts as 20.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any, Final

import numpy as np

from benchmarks.common import Cell, Row, Trials, parser_of, seeds_of, share, sweep, table
from palpate.adapters.config import RunConfig, scenario
from palpate.adapters.experiments import loaded_policy, perception_settings
from palpate.adapters.experiments.evaluation import FIRST_EVALUATION_TRIAL
from palpate.core.motion import Kinematics, ToolGeometry, arm_named
from palpate.core.motion.arm import ARMS
from palpate.core.policy import PolicyDocument, document_of, learner_of

BLOCK: Final = 10
TRAINED: Final = 10
WORLDS: Final = {
    "ur5": ("blind", "ur5"),
    "clearance 0.04 mm": ("blind-tight", "zebra-zero"),
    "tilt 4 mrad": ("blind-tilt-4", "zebra-zero"),
}


@cache
def trained(name: str, seed: int) -> tuple[PolicyDocument, dict[str, Any]]:
    """Return the policy after ten trials on the Zebra Zero in a scenario, and the learner's state."""
    config = replace(scenario(name, "belief"), seed=seed)
    with Trials(config) as trials:
        trials.run(range(TRAINED))
        settings = perception_settings(config, trials.perception)
        return document_of(trials.policy, created_with={}, perception=settings), _state(trials)


def _state(trials: Trials) -> dict[str, Any]:
    learner = learner_of(trials.policy)
    if learner is None:
        raise SystemExit("the policy does not learn")
    return learner.get_state()


def block(cell: Cell) -> dict[str, Any]:
    """Run ten trials of the frozen policy on an arm."""
    document, _ = trained(cell["scenario"], cell["train_seed"])
    config = replace(scenario(cell["scenario"], "belief"), arm=cell["arm"], seed=cell["seed"])
    first = FIRST_EVALUATION_TRIAL + cell["block"] * BLOCK
    make = lambda config, perception, _: loaded_policy(document, config, perception, frozen=True)  # noqa: E731
    with Trials(config, make) as trials:
        return {"trials": trials.run(range(first, first + BLOCK))}


def transferred(cell: Cell) -> dict[str, Any]:
    """Train in another cell, both from scratch and after training in ``blind``."""
    _, state = trained("blind", cell["seed"])
    preset, arm = WORLDS[cell["world"]]
    config: RunConfig = replace(scenario(preset, "belief"), arm=arm, seed=cell["seed"] + 5000)
    found = {}
    for name in ("untrained", "from blind"):
        with Trials(config) as trials:
            learner = learner_of(trials.policy)
            if learner is not None and name == "from blind":
                learner.set_state(state)
            found[name] = trials.run(range(cell["trials"]))
    return found


def frozen_lines(options: Any) -> list[tuple[object, ...]]:
    # Blocks first: an early end leaves some of each arm.
    cells = [
        {"scenario": name, "arm": arm, "train_seed": options.train_seed, "seed": options.first_seed, "block": number}
        for number in range(-(-options.trials // BLOCK))
        for name in options.scenarios
        for arm in options.arms
    ]
    found = sweep(options, block, cells)
    rows = []
    for name in options.scenarios:
        for arm in options.arms:
            trials = [
                Row(*row)
                for cell, one in found
                for row in one["trials"]
                if (cell["scenario"], cell["arm"]) == (name, arm)
            ]
            times_s = [row.time_s for row in trials]
            joints = Kinematics(arm_named(arm), ToolGeometry()).joints
            good = share(sum(row.success for row in trials), len(trials))
            spread = (float(np.median(times_s)), float(np.mean(times_s)), float(np.quantile(times_s, 0.95)))
            rows.append((name, arm, joints, good, *spread, max(row.peak_N for row in trials)))
    return rows


def transfer_lines(options: Any) -> list[tuple[object, ...]]:
    cells = [{"world": world, "seed": seed, "trials": options.trials} for seed in seeds_of(options) for world in WORLDS]
    found = sweep(options, transferred, cells)
    rows = []
    for world in WORLDS:
        for name in ("untrained", "from blind"):
            trials = [[Row(*row) for row in one[name]] for cell, one in found if cell["world"] == world]
            times_s = np.array([[row.time_s for row in rows] for rows in trials])
            failed = sum(not row.success for rows in trials for row in rows)
            means = [float(times_s[:, part].mean()) if times_s[:, part].size else float("nan")
                     for part in (slice(0, 1), slice(1, 5), slice(5, None))]  # fmt: skip
            rows.append((world, name, *means, f"{failed} of {times_s.size}"))
    return rows


def main() -> None:
    parser = parser_of(__doc__, seeds=1, first_seed=2201, trials=100)
    parser.add_argument("--arms", nargs="+", default=tuple(ARMS), choices=tuple(ARMS))
    parser.add_argument("--scenarios", nargs="+", default=("blind", "paper"))
    parser.add_argument("--train-seed", type=int, default=2200)
    parser.add_argument("--transfer", action="store_true", help="train in other cells")
    options = parser.parse_args()
    if options.transfer:
        print(table(("cell", "start", "trial 1, s", "2-5, s", "6-, s", "failed"), transfer_lines(options)))
    else:
        head = ("scenario", "arm", "joints", "success", "median, s", "mean, s", "p95, s", "highest true force, N")
        print(table(head, frozen_lines(options)))


if __name__ == "__main__":
    main()
