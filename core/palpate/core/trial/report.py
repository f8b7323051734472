"""Trial inputs and results as plain values."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    # This import needs kinematics, which an observer should not load.
    from palpate.core.trial.constraints import Trip


class Phase(enum.Enum):
    """Insertion trial phases in order; other tasks share the first three and the last."""

    LIFT = "lift"
    TRANSFER = "transfer"
    SETTLE = "settle"
    APPROACH = "approach"
    EXPLORE = "explore"
    INSERT = "insert"
    DONE = "done"


class Outcome(enum.Enum):
    """Trial outcome according to port data; DONE denotes a completed task other than an insertion."""

    INSERTED = "inserted"
    DONE = "done"
    OUT_OF_TOLERANCE = "out of tolerance"
    TIME_LIMIT = "time limit"
    WEDGED = "wedged"
    UNCERTAIN_DEPTH = "uncertain depth"
    FORCE_LIMIT = "force limit"
    NO_CONTACT = "no contact"
    CONTACT_MISMATCH = "contact mismatch"
    SENSOR_FAULT = "sensor fault"
    STOPPED = "stopped from outside"
    TRIPPED = "safety trip"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True, slots=True)
class TrialSetup:
    """Data that distinguish one trial from another for the core.

    Attributes:
        index: Trial number within its run, from 0.
        seed: The run's seed; with the index it determines every random stream.
        start_m: Start position above the plate, (x, y) in the task frame.
    """

    index: int
    seed: int
    start_m: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Event:
    """An event for the log."""

    tick: int
    name: str
    detail: str = ""


@dataclass(slots=True)
class DecisionRecord:
    """One choice of action and its reinforcement; updated during the trial.

    Attributes:
        reinforcement: Reinforcement for the action; None until it is known, or if the action was interrupted.
        displacement_m: Commanded tip displacement, (2,), task frame.
        index: Index in the action set; None if the action is not in the set.
        grounds: Inputs to the choice: the observation's force, (3,), N, and torque, (3,), N m, the features, and
            numbers that the policy adds.
        controller: Controller for an action in six degrees of freedom; empty for a step in the plane.
        spatial: The other parameters of such an action, (8,), in the order of :class:`~palpate.core.policy.Spatial`.
    """

    tick: int
    symbol: str
    state: str
    action: str
    source: str
    reinforcement: float | None = None
    displacement_m: tuple[float, float] = (0.0, 0.0)
    index: int | None = None
    grounds: tuple[float, ...] = ()
    controller: str = ""
    spatial: tuple[float, ...] = ()


@dataclass
class TrialTiming:
    """Tick and sample timing in a trial; always perfect in a simulator.

    Attributes:
        worst_late_ns: Maximum tick delay relative to its slot.
        late_ticks: Number of ticks that began more than a millisecond late.
        repeated_samples: Number of ticks at which a sensor had no new sample.
    """

    worst_late_ns: int = 0
    late_ticks: int = 0
    skipped_slots: int = 0
    repeated_samples: int = 0


@dataclass
class TrialReport:
    """Trial result from port data alone.

    Attributes:
        exploration_time_s: Time from contact to the hole, or to the end of the trial.
        peak_force_N: Maximum norm of the measured force, tared, over the control ticks after taring.
        depth_m: Estimated final tip depth below the plate's surface.
        temperature: Exploration temperature during the trial; None for policies without one.
        trip: Cause of the supervisor's trip; None if there was none.
    """

    setup: TrialSetup
    outcome: Outcome | None = None
    exploration_time_s: float = 0.0
    actions: int = 0
    peak_force_N: float = 0.0
    depth_m: float = 0.0
    ticks: int = 0
    clamped_ticks: int = 0
    events: list[Event] = field(default_factory=list)
    decisions: list[DecisionRecord] = field(default_factory=list)
    temperature: float | None = None
    timing: TrialTiming = field(default_factory=lambda: TrialTiming())
    trip: Trip | None = None


INTERRUPT: Final = "interrupt"
"""Name of the event recorded in the first tick that notices an interruption."""


class Purpose(enum.IntEnum):
    """Purposes for which random numbers are drawn. Never renumber the values, because they are part of every log."""

    START = 0
    HOLE = 1
    SENSOR = 2
    POLICY = 3
    PARTITION = 4
    FITTING = 5
    RANDOM_WALKS = 6
    HOLE_SHIFT = 7
    GRIP = 8
    ZERO = 9
    HIDDEN = 10
    PLATE = 11
    DITHER = 12
    LIMIT = 13


TRIALS_OF_A_SERIES: Final = 500_000
"""Each multiple of this number starts a series of trials with separate random streams: training, evaluation, and
perception fitting, in this order."""


def generator(seed: int, purpose: Purpose, trial: int) -> np.random.Generator:
    """Return the random number generator for one purpose in one trial."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(int(purpose), trial)))
