"""Tabular learning in the grid worlds with ambiguous sensors: palpate's learners beside those of MushroomRL.

    python -m benchmarks.tabular_peers --cache ~/.cache/palpate-peers --seeds 10

MushroomRL 1.10.2 is the published package whose Q-learning, Sarsa(lambda) and Boltzmann policy are the same algorithms.
It learns through ``palpate/SensorMap-v0``, with the same settings (constant learning rates, as it has them) and from
the same starts; its random numbers are others. It pins older versions of NumPy and PyTorch that palpate does not run
with, so it is installed without its dependencies; its tabular part works with newer ones.

Each learner's package and seed is a process of its own, and they take turns. A trial that is cut off counts with its
limit. Times are CPU times of learning and world together; palpate learns without Gymnasium in between.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from palpate.adapters.config.grid import TRIALS, GridLearning
from palpate.adapters.experiments.grid.learning import learn
from palpate.adapters.experiments.grid.report import LAST
from palpate.adapters.experiments.grid.worlds import Named, bounds_of, grid_named

ROOT = Path(__file__).parents[1]
MAPS = (("1", "symbols"), ("2", "symbols"), ("2", "last-2"))
SETTINGS = {
    "q": GridLearning(learner="q", alpha=0.2, temperature=1.0, back_off=0.0),
    "sarsa": GridLearning(learner="sarsa", alpha=0.1, temperature=1.0),
}
PEER = ("mushroom-rl==1.10.2", "opencv-python-headless", "pygame")


def by_palpate(name: str, state: str, learner: str, seed: int, trials: int) -> list[int]:
    """Steps of each trial."""
    return learn(grid_named(name, 7), Named(state), SETTINGS[learner], seed, trials).steps


def by_mushroom(name: str, state: str, learner: str, seed: int, trials: int) -> list[int]:
    """Steps of each trial, learned by MushroomRL through the environment."""
    import gymnasium
    import numpy as np
    from mushroom_rl.algorithms.value import QLearning, SARSALambda
    from mushroom_rl.core import Core, Environment, MDPInfo
    from mushroom_rl.policy import Boltzmann
    from mushroom_rl.utils.parameters import Parameter
    from mushroom_rl.utils.spaces import Discrete

    import palpate.adapters.gymnasium_envs as envs

    settings = SETTINGS[learner]
    parameters: Any = settings.parameters()
    steps = [0]

    class World(Environment):  # type: ignore[misc]
        def __init__(self) -> None:
            self.env: Any = gymnasium.make(envs.SENSOR_MAP, map=name, state=state)
            spaces = Discrete(int(self.env.observation_space.n)), Discrete(int(self.env.action_space.n))
            self.first = True
            super().__init__(MDPInfo(*spaces, gamma=settings.gamma, horizon=settings.step_limit))

        def reset(self, state: Any = None) -> Any:
            seen, _ = self.env.reset(seed=seed if self.first else None)
            self.first = False
            return np.array([seen])

        def step(self, action: Any) -> Any:
            seen, reward, terminated, truncated, _ = self.env.step(int(action[0]))
            steps[-1] += 1
            if terminated or truncated:
                steps.append(0)
                # One temperature for a whole trial, as palpate has it.
                policy.set_beta(Parameter(1.0 / parameters.temperature.at(len(steps) - 1)))
            return np.array([seen]), reward, terminated, {}

        def stop(self) -> None:
            return

    np.random.seed(seed)  # noqa: NPY002, TID251 - it is from there that MushroomRL draws
    world, policy = World(), Boltzmann(Parameter(1.0 / parameters.temperature.at(0)))
    rate = Parameter(parameters.alpha)
    if learner == "sarsa":
        agent = SARSALambda(world.info, policy, rate, lambda_coeff=parameters.trace_decay)
    else:
        agent = QLearning(world.info, policy, rate)
    Core(agent, world).learn(n_episodes=trials, n_steps_per_fit=1, quiet=True)
    return steps[:trials]


WORKERS: dict[str, Callable[[str, str, str, int, int], list[int]]] = {
    "palpate": by_palpate,
    "MushroomRL": by_mushroom,
}


def work(who: str, seed: int, trials: int) -> None:
    rows = []
    for name, state in MAPS:
        for learner in SETTINGS:
            WORKERS[who](name, state, learner, seed, 3)  # whatever is loaded on first use does not count
            start = time.process_time()
            steps = WORKERS[who](name, state, learner, seed, trials)
            seconds = time.process_time() - start
            last = steps[-LAST:]
            rows.append(
                {
                    "who": who, "map": name, "state": state, "learner": learner, "seed": seed, "seconds": seconds,
                    "steps": sum(steps), "first": statistics.mean(steps[:LAST]), "last": statistics.mean(last),
                }
            )  # fmt: skip
    print(json.dumps(rows))


def peer_python(cache: Path) -> Path:
    """The interpreter that has palpate and its peer, installed now if it is not yet."""
    folder = cache / "mushroom-rl"
    python, ready = folder / "bin" / "python", folder / "ready"
    if not ready.exists():
        print(f"installing palpate and {PEER[0]} into {folder}", file=sys.stderr)
        subprocess.run([sys.executable, "-m", "venv", "--clear", str(folder)], check=True)
        pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        subprocess.run([*pip, "-c", str(ROOT / "constraints.txt"), "-e", f"{ROOT}[gymnasium]"], check=True)
        subprocess.run([*pip, "--no-deps", *PEER], check=True)
        ready.touch()
    return python


def measured(who: str, python: Path, seed: int, trials: int) -> list[dict[str, Any]]:
    """One learner, one seed, every map, in a process of its own."""
    words = [str(python), "-W", "ignore", __file__, "--worker", who, "--first", str(seed), "--trials", str(trials)]
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYGAME_HIDE_SUPPORT_PROMPT": "1"}
    done = subprocess.run(words, capture_output=True, text=True, env=environment, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{who}: {done.stderr.strip().splitlines()[-1]}")
    rows: list[dict[str, Any]] = json.loads(done.stdout.splitlines()[-1])
    return rows


def table(rows: list[dict[str, Any]]) -> str:
    head = ("map, states", "learner", "by", f"first {LAST}", f"last {LAST}", "lowest to highest", "CPU us a step", "")
    lines = [head]
    for name, state in MAPS:
        bounds = bounds_of(grid_named(name, 7))
        optimum = "" if bounds.belief is None else f"best possible {bounds.belief:.2f}"
        for learner in SETTINGS:
            for who in WORKERS:
                own = [r for r in rows if (r["map"], r["state"], r["learner"], r["who"]) == (name, state, learner, who)]
                last = [r["last"] for r in own]
                lines.append(
                    (
                        f"{name}, {state}", learner, who, f"{statistics.mean(r['first'] for r in own):.2f}",
                        f"{statistics.mean(last):.2f}", f"{min(last):.2f} to {max(last):.2f}",
                        f"{statistics.median(r['seconds'] / r['steps'] for r in own) * 1e6:.1f}", optimum,
                    )
                )  # fmt: skip
    widths = [max(len(line[column]) for line in lines) for column in range(len(head))]
    text = ["  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) for line in lines]
    return "\n".join(line.rstrip() for line in text)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cache", type=Path, help="folder for the peer's virtual environment")
    parser.add_argument("--python", type=Path, help="an interpreter that has palpate and the peer already")
    parser.add_argument("--seeds", type=int, default=10, help="how many")
    parser.add_argument("--first", type=int, default=200, help="the first of them")
    parser.add_argument("--trials", type=int, default=TRIALS, help=f"trials of a run, {LAST} or more")
    parser.add_argument("--json", type=Path, help="write every run here")
    parser.add_argument("--worker", choices=WORKERS, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        work(options.worker, options.first, options.trials)
        return
    if options.seeds < 1 or options.first < 0 or options.trials < LAST:
        parser.error(f"--seeds must be 1 or more, --first 0 or more, --trials {LAST} or more")
    if options.cache is None and options.python is None:
        parser.error("--cache FOLDER is needed for the peer, or --python INTERPRETER")
    # Not resolved: the interpreter of a virtual environment is a link, and it is by its place that it knows its own.
    peer = options.python.absolute() if options.python else peer_python(options.cache.expanduser().resolve())
    pythons = {"palpate": Path(sys.executable), "MushroomRL": peer}
    rows: list[dict[str, Any]] = []
    for seed in range(options.first, options.first + options.seeds):
        for who, python in pythons.items():
            rows += measured(who, python, seed, options.trials)
        print(f"seed {seed}", file=sys.stderr)
    print(table(rows))
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
