"""What a tick costs beside physics, and a training run over its bare physics: two checkouts, turn by turn.

    python -m benchmarks.tick_turns --before ../before --trials 20

Each checkout has a process of its own, which runs one trial of learning when it is told to; they take turns, so that
the machine's mood meets both. All times are processor time of the thread. A trial is run again and again, each time on
a cell of its own, the same to the bit: with a look at the thread's clock before and after each call of
``WorkCell.advance``, for ``without physics``, what a tick takes between two of these, its median and mean; and then in
turns whole, from making the world ready to the score, with no clock read in it, for a look at it takes a microsecond,
and as ``floor``, the trial's physics alone, which must end in the same state. Of the latter two the least of three
runs counts: what else a machine does can only add to it.

The floor makes the same ``mj_step`` calls on the same models under the same commands. Not in it, and so a part of what
the run takes over it, are making ready and scoring, and ticks that end where their list of contact pairs is incomplete
and are done over: the floor has these once.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from time import thread_time_ns
from typing import Any

import numpy as np

from benchmarks.tick_setups import Parts

HERE = Path(__file__).parents[1]
SEED = 700
TIMES = 3


class Worker:
    """Trials of one checkout, in this process.

    Args:
        checkout: Whose.
        folder: For what has to be written down for that.
    """

    def __init__(self, checkout: Path, folder: Path) -> None:
        parts = Parts(checkout, folder)
        from dataclasses import replace

        import mujoco

        from palpate.adapters.experiments.policies import learning_policy

        self._mujoco, self._run = mujoco, parts.run_scored_trial
        self._config = config = replace(parts.scenario("paper"), seed=SEED)
        ready, perception = parts.find_ready_pose(config.arm, config.task), parts.build_perception(config)

        def learner() -> tuple[Any, Any]:
            rig = parts.SimulatedRig(config, ready)
            rig.__enter__()
            return rig, parts.build_task(config, ready, perception, learning_policy(config, perception))

        self._timed, self._wholes = learner(), [learner() for _ in range(TIMES)]
        self._bare = parts.SimulatedRig(config, ready).cell

    def trial(self, index: int) -> dict[str, float]:
        """One trial: its ticks, and nanoseconds of its parts."""
        rig, task = self._timed
        cell = rig.cell
        plain = cell.advance
        commands: list[tuple[Any, int]] = []
        ends: list[int] = []
        begins: list[int] = []

        def advance() -> None:
            begins.append(thread_time_ns())
            plain()
            # Physics leave the command as it is.
            contacts = getattr(cell, "contacts", None)
            commands.append((cell.data.ctrl.copy(), -1 if contacts is None else contacts.level))
            ends.append(thread_time_ns())

        cell.advance = advance
        self._run(self._config, rig, task, index)
        cell.advance = plain
        between = np.array(begins[1:]) - np.array(ends[:-1])
        whole_ns, floor_ns = [], []
        for learner in self._wholes:
            began = thread_time_ns()
            self._run(self._config, *learner, index)
            whole_ns.append(thread_time_ns() - began)
            floor_ns.append(self._floor(index, commands))
            for other in (learner[0].cell, self._bare):
                if not np.array_equal(other.data.qpos, cell.data.qpos):
                    raise SystemExit(f"trial {index} went otherwise when it was run again")
        return {
            "ticks": len(commands),
            "median_ns": float(np.median(between)),
            "mean_ns": float(np.mean(between)),
            "whole_ns": float(min(whole_ns)),
            "floor_ns": float(min(floor_ns)),
        }

    def _floor(self, index: int, commands: list[tuple[Any, int]]) -> int:
        mujoco, cell = self._mujoco, self._bare
        cell.reset(SEED, index)
        models = [cell.model] if getattr(cell, "contacts", None) is None else cell.contacts.models
        data, substeps = cell.data, cell.config.substeps
        began = thread_time_ns()
        for command, level in commands:
            data.ctrl[:] = command
            mujoco.mj_step(models[level], data, substeps)
        return thread_time_ns() - began


def serve(checkout: Path) -> None:
    """Run trials as they are asked for by number, a line each."""
    with tempfile.TemporaryDirectory() as folder:
        worker = Worker(checkout, Path(folder))
        for line in sys.stdin:
            print(json.dumps(worker.trial(int(line))), flush=True)


def ratio(new: np.ndarray, old: np.ndarray) -> str:
    """Of the sums, with its 95 % bootstrap interval over trials."""
    draws = np.random.default_rng(0).integers(len(new), size=(5000, len(new)))
    low, high = np.quantile(new[draws].sum(axis=1) / old[draws].sum(axis=1), [0.025, 0.975])
    return f"{new.sum() / old.sum():.3f} ({low:.3f} to {high:.3f})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--before", type=Path)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--serve", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve is not None:
        serve(options.serve)
        return
    checkouts = {"before": options.before.resolve(), "now": HERE}
    call = [sys.executable, "-m", "benchmarks.tick_turns", "--serve"]
    processes = {
        name: subprocess.Popen([*call, str(path)], cwd=HERE, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        for name, path in checkouts.items()
    }
    found: dict[str, list[dict[str, float]]] = {name: [] for name in processes}
    for index in range(options.trials + 1):
        for name, process in processes.items():
            assert process.stdin is not None
            assert process.stdout is not None
            process.stdin.write(f"{index}\n")
            process.stdin.flush()
            found[name].append(json.loads(process.stdout.readline()))
    for process in processes.values():
        process.communicate()
    # The first trial warms up.
    of = {
        name: {key: np.array([each[key] for each in trials[1:]]) for key in trials[0]} for name, trials in found.items()
    }
    before, now = of["before"], of["now"]
    for name, one in of.items():
        ticks = one["ticks"].sum()
        print(
            f"{name}: {ticks:.0f} ticks; a tick without physics: median {np.median(one['median_ns']) * 1e-3:.1f} us,"
            f" mean {(one['mean_ns'] * one['ticks']).sum() / ticks * 1e-3:.1f} us; with it"
            f" {one['whole_ns'].sum() / ticks * 1e-3:.1f} us, of that bare physics"
            f" {one['floor_ns'].sum() / ticks * 1e-3:.1f} us; run over bare physics"
            f" {ratio(one['whole_ns'], one['floor_ns'])}"
        )
    print(f"now over before: tick without physics, median {ratio(now['median_ns'], before['median_ns'])}")
    per_tick = {key: (now[key] / now["ticks"], before[key] / before["ticks"]) for key in ("whole_ns", "floor_ns")}
    print(f"now over before: training run, a tick {ratio(*per_tick['whole_ns'])}")
    print(f"now over before: bare physics, a tick {ratio(*per_tick['floor_ns'])}")


if __name__ == "__main__":
    main()
