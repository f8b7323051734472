"""What several of these tests need: trials and policies that were never run."""

import io
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.image import imread

from palpate.adapters.experiments.results import TrialRow
from palpate.core.policy import (
    ActionEntry,
    LearnerEntry,
    PolicyDocument,
    QParameters,
    TableRow,
    TemperatureSchedule,
    compass_actions,
)
from tests.unit.adapters.samples import trial_rows

ACTIONS = tuple(ActionEntry.of(action) for action in compass_actions(0.7e-3))
PARAMETERS = QParameters(alpha=0.3, gamma=1.0, temperature=TemperatureSchedule(1.0, 1.0, 0.0))
NAMES = tuple(action.name for action in ACTIONS)
SIGNS = "-0+"
POSITION = tuple(f"x{x} y{y}" for x in SIGNS for y in SIGNS if (x, y) != ("0", "0"))
TORQUE = tuple(f"tx{x} ty{y}" for x in SIGNS for y in SIGNS)


def rows(*times_s: float, wins: Sequence[bool] | None = None) -> list[TrialRow]:
    """Trials with these times, all of them successes if nothing else is said."""
    wins = wins or [True] * len(times_s)
    return [replace(row, success=win) for row, win in zip(trial_rows(*times_s), wins, strict=True)]


def row(state: str, action: str, value: float = -2.0, visits: int = 8, source: str = "learned") -> TableRow:
    """A line of a policy's table; every action was tried as often as the others, and the others are worse by one."""
    best = NAMES.index(action)
    q = tuple(value if n == best else value - 1.0 for n in range(len(NAMES)))
    return TableRow(state, source, action, best, q, (visits // len(NAMES),) * len(NAMES))


def policy(*table: TableRow) -> PolicyDocument:
    """A policy with these lines."""
    state = {"q": [line.q for line in table], "visits": [line.visits_per_action for line in table]}
    return PolicyDocument(
        created_with={},
        perception={},
        states=tuple(line.state for line in table),
        actions=ACTIONS,
        programmed={line.state: line.action for line in table if line.source == "programmed"},
        examples={line.state: line.action for line in table if line.source == "examples"},
        learner=LearnerEntry("q-learning", PARAMETERS, state | {"trials_learned": 1}),
    )


def pixels(png: bytes) -> np.ndarray:
    """(height, width, 3), 0 to 255."""
    return (imread(io.BytesIO(png), format="png") * 255).round().astype(int)[..., :3]
