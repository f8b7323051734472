"""Small worlds with hidden states, and trials in them."""

import numpy as np

from palpate.core.perception import IdentityState
from palpate.core.policy import RandomWalkPolicy
from palpate.core.policy.hmm import DisplacementHmm, FinitePomdp, RecordedTrial
from palpate.core.policy.hmm.displacement_hmm import lattice_steps
from palpate.simulation.grid import GridMap, grid_actions, run_trial

STEPS = lattice_steps(grid_actions())
AMBIGUOUS = GridMap.from_text("ABACB\nCA#BA\nBC·AC\nABCAB\nCBABA")


def random_trials(grid, count, seed=0, limit=40):
    """Random walks on a map."""
    identity, policy = IdentityState(grid.symbols), RandomWalkPolicy(grid_actions())
    walks = [run_trial(grid, identity, policy, seed, trial, step_limit=limit) for trial in range(count)]
    return [RecordedTrial(walk.symbols, walk.actions, walk.reached) for walk in walks]


def true_offsets(grid):
    """The model that a map is of."""
    row = next(y for y, line in enumerate(grid.rows) if "·" in line)
    column = grid.rows[row].index("·")
    blocked = np.array([[float(moves[action] == cell) for cell, moves in enumerate(grid.moves)] for action in range(8)])
    return DisplacementHmm(
        STEPS,
        tuple((x - column, row - y) for x, y in grid.cells),
        np.full(len(grid.cells), 1.0 / len(grid.cells)),
        blocked,
        np.eye(len(grid.symbols))[list(grid.readings)],
    )


def random_pomdp(rng, states=3, actions=2, symbols=2):
    """Any world at all."""
    moves = rng.dirichlet(np.ones(states + 1), size=(actions, states))
    start, emissions = rng.dirichlet(np.ones(states)), rng.dirichlet(np.ones(symbols), size=states)
    return FinitePomdp(start, moves[:, :, :states], moves[:, :, states], emissions)
