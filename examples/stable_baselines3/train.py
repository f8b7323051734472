"""Compare a Stable-Baselines3 agent with palpate's own tabular learner on the same trials of the insertion task.

    pip install -e '.[gymnasium]' -r examples/stable_baselines3/requirements.txt -c constraints.txt
    python examples/stable_baselines3/train.py --out runs/sb3                   DQN on the 17 states, 350 trials
    python examples/stable_baselines3/train.py --out runs/sb3 --agent ppo       PPO on tip and wrench, free steps
    python examples/stable_baselines3/train.py --out runs/sb3 --trials 60       a short form

Both learn from scratch in ``palpate/PegInsertion-v0`` on trials 0, 1, 2, ... of one seed. The starts and sensor errors
are the same, but the actions differ. The results are saved as ``curves.csv`` and ``learning_curves.png``.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.wrappers import RescaleObservation
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from stable_baselines3 import DQN, PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.monitor import Monitor

from palpate.adapters.config import RunConfig
from palpate.adapters.experiments import WINDOW, build_perception, learning_policy, moving_average
from palpate.adapters.gymnasium_envs import PEG_INSERTION
from palpate.core.policy import Observation, Transition
from palpate.core.trial import Purpose, generator

NOWHERE = (0.0, 0.0, 0.0)
COLOURS = ("#4878a8", "#d1751e")


@dataclass
class Curve:
    """Results of all trials of a learner."""

    name: str
    trials: list[int] = field(default_factory=list)
    times_s: list[float] = field(default_factory=list)
    successes: list[bool] = field(default_factory=list)
    decisions: int = 0

    def add(self, info: dict[str, Any]) -> None:
        """Add the last ``info`` of an episode."""
        self.trials.append(info["trial"])
        self.times_s.append(info["exploration_time_s"])
        self.successes.append(info["is_success"])
        self.decisions += info["decisions"]

    def line(self) -> str:
        """Return a one-line summary of the first and last trials."""
        count = min(WINDOW, len(self.times_s))
        first, last = np.mean(self.times_s[:count]), np.mean(self.times_s[-count:])
        wins = f"{sum(self.successes[-count:])} of {count}"
        return (
            f"{self.name}: {len(self.trials)} trials, {self.decisions} decisions; mean exploration time {first:.2f} s "
            f"in the first {count} and {last:.2f} s in the last {count}, inserted in the last {count}: {wins}"
        )


class Trials(BaseCallback):
    """Callback that records the result of each trial and stops the training after a given number of trials."""

    def __init__(self, curve: Curve, trials: int) -> None:
        super().__init__()
        self._curve, self._most = curve, trials

    def _on_step(self) -> bool:
        for done, info in zip(self.locals["dones"], self.locals["infos"], strict=True):
            if done:
                self._curve.add(info)
        return len(self._curve.trials) < self._most


def dqn(seed: int) -> DQN:
    """Create a deep Q-learning agent with the same input as palpate's learner, a one-hot vector of the 17 states."""
    env = Monitor(gymnasium.make(PEG_INSERTION))
    return DQN(
        "MlpPolicy", env, seed=seed, learning_rate=1e-3, gamma=0.99, learning_starts=200, batch_size=64,
        train_freq=4, target_update_interval=500, exploration_fraction=0.1, exploration_final_eps=0.1,
        policy_kwargs={"net_arch": [64]}, device="cpu",
    )  # fmt: skip


def ppo(seed: int) -> PPO:
    """Create a policy-gradient agent that observes tip and wrench, scaled to -1 to 1, and chooses continuous steps."""
    env = gymnasium.make(PEG_INSERTION, observations="raw", actions="continuous")
    scaled = Monitor(RescaleObservation(env, np.float32(-1.0), np.float32(1.0)))
    return PPO("MlpPolicy", scaled, seed=seed, n_steps=512, batch_size=64, gamma=0.99, device="cpu")


AGENTS: dict[str, tuple[str, Callable[[int], Any]]] = {
    "dqn": ("Stable-Baselines3 DQN, 17 states", dqn),
    "ppo": ("Stable-Baselines3 PPO, tip and wrench, free steps", ppo),
}


def deep(agent: str, seed: int, trials: int) -> Curve:
    """Train a Stable-Baselines3 agent, and return its learning curve."""
    name, make = AGENTS[agent]
    curve, model = Curve(name), make(seed)
    # So many decisions that the trials are over before; what depends on the progress counts on 100 a trial.
    model.learn(total_timesteps=100 * trials, callback=Trials(curve, trials))
    while len(curve.trials) < trials:
        model.learn(total_timesteps=100 * trials, callback=Trials(curve, trials), reset_num_timesteps=False)
    model.get_env().close()
    return curve


def tabular(seed: int, trials: int) -> Curve:
    """Train palpate's Q-learning on the trials that ``palpate train`` uses for this seed, and return its curve."""
    config, curve = RunConfig(), Curve("palpate Q-learning, 17 states")
    policy = learning_policy(config, build_perception(config))
    # Failures end like any other trial for it, at the state where they ended: it needs no penalty.
    env: Any = gymnasium.make(PEG_INSERTION, failure_penalty=0.0)
    for number in range(trials):
        state, info = env.reset(seed=seed if number == 0 else None)
        policy.begin_trial(info["trial"], generator(seed, Purpose.POLICY, info["trial"]))
        over = False
        while not over:
            seen = Observation(int(state), NOWHERE, NOWHERE, NOWHERE, NOWHERE, info["decisions"])
            index = policy.choose(seen).index
            after, reward, terminated, truncated, info = env.step(index)
            goal = info["outcome"] == "inserted"
            policy.learn(Transition(int(state), int(index or 0), reward, None if goal else int(after)))
            state, over = after, terminated or truncated
        curve.add(info)
    env.close()
    return curve


def write_csv(curves: list[Curve], path: Path) -> None:
    """Write one row for each trial of each learner."""
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(("learner", "trial", "exploration_time_s", "success"))
        for c in curves:
            writer.writerows((c.name, *row) for row in zip(c.trials, c.times_s, c.successes, strict=True))


def draw(curves: list[Curve], seed: int, path: Path) -> None:
    """Plot the exploration time of every trial, and the moving averages."""
    figure = Figure(figsize=(8.0, 4.2), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    axes: Any = figure.add_subplot()
    for curve, colour in zip(curves, COLOURS, strict=True):
        numbers = range(1, len(curve.trials) + 1)
        axes.scatter(numbers, curve.times_s, s=10, color=colour, alpha=0.4, linewidths=0)
        axes.plot(numbers, moving_average(curve.times_s), color=colour, linewidth=2.0, label=curve.name)
    axes.legend(loc="upper right", title=f"moving average of {WINDOW}")
    axes.set(xlabel="trial", ylabel="exploration time [s]", title=f"Peg in hole, scenario paper, seed {seed}")
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0.0)
    axes.grid(alpha=0.25)
    figure.savefig(path)


def main() -> None:
    """Parse the command line, and run the script."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--agent", choices=AGENTS, default="dqn")
    parser.add_argument("--trials", type=int, default=350)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, required=True, help="output folder; must not contain earlier results")
    options = parser.parse_args()
    if options.trials < 1 or options.seed < 0:
        parser.error("--trials must be 1 or more, --seed 0 or more")
    table, picture = options.out / "curves.csv", options.out / "learning_curves.png"
    if table.exists() or picture.exists():
        parser.error(f"{options.out} holds the results of another run; name another folder with --out")
    options.out.mkdir(parents=True, exist_ok=True)
    curves = [tabular(options.seed, options.trials)]
    print(curves[0].line(), flush=True)
    curves.append(deep(options.agent, options.seed, options.trials))
    print(curves[1].line())
    write_csv(curves, table)
    draw(curves, options.seed, picture)
    print(f"look at {picture}")


if __name__ == "__main__":
    main()
