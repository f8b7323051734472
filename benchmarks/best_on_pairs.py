"""What the last two readings and the action between them allow at best: a search beside the learner `pairs-2`.

    python -m benchmarks.best_on_pairs --maps 43000-43004 --slips 0.1

Policies on these states are evaluated exactly, over all starts and with what chance does to moves and readings, steps
cut off at 100, and improved by natural policy gradient from several beginnings; the best deterministic one that was met
is told, over the optimum without disturbance. It is the best found: what is possible may be better still.
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

from benchmarks.memory_maps import facts, map_of, span
from palpate.simulation.grid import STEP_LIMIT, GridMap

Floats = NDArray[np.float64]
BEGINNINGS, ROUNDS = 4, 60


class World:
    """The map with what chance does; a context is the reading before and the action after it, or the start."""

    def __init__(self, grid: GridMap, slips: float, misreads: float) -> None:
        self.cells, self.symbols, self.slips = len(grid.cells), len(grid.symbols), slips
        self.to = np.array([[self.cells if to is None else to for to in row] for row in grid.moves])
        self.read = np.full((self.cells, self.symbols), misreads / self.symbols)
        self.read[np.arange(self.cells), grid.readings] += 1.0 - misreads
        self.actions = self.to.shape[1]
        self.contexts = self.symbols * self.actions + 1

    def cost(self, policy: Floats) -> tuple[float, Floats]:
        """Steps from all starts, and how often each cell, context and reading is met, (cells, contexts, symbols)."""
        now = np.zeros((self.cells, self.contexts, self.symbols))
        now[:, -1] = self.read / self.cells
        met = np.zeros_like(now)
        for _ in range(STEP_LIMIT):
            met += now
            done = np.einsum("ckr,kra->cra", now, policy)
            moved = np.zeros((self.cells + 1, self.symbols, self.actions))
            for action in range(self.actions):
                np.add.at(moved[:, :, action], self.to[:, action], (1.0 - self.slips) * done[:, :, action])
            arrived = (moved[:-1] + self.slips * done).reshape(self.cells, -1)
            now[:, -1] = 0.0
            now[:, :-1] = arrived[:, :, None] * self.read[:, None]
        return float(met.sum()), met

    def values(self, policy: Floats) -> Floats:
        """Steps to the goal after each action, (cells, symbols, actions)."""
        costs = np.ones((self.cells, self.symbols, self.actions))
        for _ in range(STEP_LIMIT):
            mean = np.einsum("ckr,cr->ck", np.einsum("kra,cra->ckr", policy, costs), self.read)[:, :-1]
            after = np.zeros((self.cells + 1, self.symbols, self.actions))
            after[:-1] = mean.reshape(self.cells, self.symbols, self.actions)
            ahead = np.stack([after[self.to[:, action], :, action] for action in range(self.actions)], axis=2)
            costs = 1.0 + (1.0 - self.slips) * ahead + self.slips * after[:-1]
        return costs

    def best(self, rng: np.random.Generator) -> float:
        """Steps that the best deterministic policy takes that was met from one beginning."""
        weights, best = rng.normal(size=(self.contexts, self.symbols, self.actions)), float("inf")
        for number in range(ROUNDS):
            policy = np.exp(weights - weights.max(axis=2, keepdims=True))
            policy /= policy.sum(axis=2, keepdims=True)
            _, met = self.cost(policy)
            costs = np.einsum("ckr,cra->kra", met, self.values(policy)) / np.maximum(met.sum(axis=0), 1e-12)[..., None]
            weights -= (0.3 + 0.1 * number) * (costs - costs.min(axis=2, keepdims=True))
            best = min(best, self.cost(np.eye(self.actions)[weights.argmax(axis=2)])[0])
        return best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--maps", nargs="+", type=span, default=[["1"]])
    parser.add_argument("--slips", type=float, default=0.0)
    parser.add_argument("--misreads", type=float, default=0.0)
    options = parser.parse_args()
    for name in (name for names in options.maps for name in names):
        world, optimum = World(map_of(name), options.slips, options.misreads), facts(name)["optimum"]
        found = [world.best(np.random.default_rng(seed)) / optimum for seed in range(BEGINNINGS)]
        print(f"map {name}: {min(found):.3f}, of {', '.join(f'{ratio:.3f}' for ratio in found)}", flush=True)


if __name__ == "__main__":
    main()
