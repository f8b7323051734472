"""Train, and look at what was learned.

Q-learning puts the peg into the hole over and over. You see a line for every trial, at first mostly of several seconds,
later mostly of one or two. In the end the table of what was learned is printed: for each state the best action. The
folder then holds the policy, the learning curve, a log of every trial and a picture of the last one: forces, tip,
states and actions over time.

Takes about half a minute; with ``--quick``, which is too short to learn anything, a few seconds.

The command line does the same with ``palpate train``, ``palpate show`` and ``palpate log plot``.
"""

from __future__ import annotations

import argparse
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from palpate.adapters.config import RunConfig, scenario
from palpate.adapters.experiments import (
    RunFolder,
    ScoredTrial,
    Trainer,
    build_perception,
    learning_curve,
    learning_policy,
    render_table,
    run_toml,
)
from palpate.adapters.log import LOG_FOLDER, TrialRecorder, read_log, timeline
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.errors import PalpateError, require_whole
from palpate.core.policy import PolicyDocument
from palpate.core.trial import find_ready_pose


def tell(scored: ScoredTrial) -> None:
    """A line for a trial. Whether it was a success is held against the simulator's truth."""
    report, word = scored.report, "inserted" if scored.success else "failed"
    print(f"trial {report.setup.index:3d}: {scored.exploration_time_s:5.1f} s of exploration, {word}", flush=True)


def train(config: RunConfig, trials: int, folder: RunFolder) -> None:
    """Train into the folder, as ``palpate train`` does."""
    folder.require_free()
    ready = find_ready_pose(config.arm, config.tool.geometry, config.task)
    perception = build_perception(config)
    policy = learning_policy(config, perception)
    folder.create()
    folder.write("run.toml", run_toml(config, "train", trials=trials, policy="q-learning"))
    with ExitStack() as opened:
        rig = opened.enter_context(SimulatedRig(config, ready))
        recorder = TrialRecorder.into(folder.path / LOG_FOLDER, config.recording)
        if recorder is not None:
            opened.enter_context(recorder)
        trainer = Trainer(config, folder, ready, rig, perception, policy, recorder=recorder)
        trainer.train(trials, tell)
        trainer.save_policy()


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--quick", action="store_true", help="three short trials")
    parser.add_argument("--out", type=Path, default=Path("runs/train-and-look"), help="must not hold a run yet")
    options = parser.parse_args()
    config, trials = scenario("paper"), options.trials
    if options.quick:
        config, trials = replace(config, task=replace(config.task, time_limit_s=2.0)), 3
    folder = RunFolder(options.out)
    try:
        require_whole("trials", trials, 1, 1_000_000)
        train(config, trials, folder)
        last = read_log(max((folder.path / LOG_FOLDER).glob("*.mcap")))
        folder.write("last-trial.png", timeline(last))
    except (PalpateError, OSError) as error:
        parser.error(str(error))
    folder.write("learning_curve.png", learning_curve(folder.read_trials(), "Train and look"))
    print(render_table(PolicyDocument.load(folder.path / "policy.json")))
    print(f"look at {folder.path}/learning_curve.png and {folder.path}/last-trial.png")


if __name__ == "__main__":
    main()
