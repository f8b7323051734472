"""What goes into one trial and what comes out of it, as plain values."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    # It says what the tool may do, and kinematics are loaded for that; an observer needs none.
    from palpate.core.trial.expectation import Trip


class Phase(enum.Enum):
    """Stages of an insertion trial, in their order; other tasks share the first three and the last."""

    LIFT = "lift"
    TRANSFER = "transfer"
    SETTLE = "settle"
    APPROACH = "approach"
    EXPLORE = "explore"
    INSERT = "insert"
    DONE = "done"


class Outcome(enum.Enum):
    """How a trial ended, as port data show it; a task other than an insertion that is done is DONE."""

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
    """What distinguishes one trial from the next, for the core.

    Attributes:
        index: Number of the trial within its run, from 0.
        seed: The run's seed; with the index it gives every random stream.
        start_m: Where above the plate the trial starts, (x, y) in the task frame.
    """

    index: int
    seed: int
    start_m: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Event:
    """Something worth a line in a log."""

    tick: int
    name: str
    detail: str = ""


@dataclass(slots=True)
class DecisionRecord:
    """One choice of an action, and the reinforcement that it then earned: as the report, it is written as things go on.

    Attributes:
        reinforcement: What the action then earned; None while it is not known, or when it was interrupted.
        displacement_m: What was asked of the tip, (2,), task frame.
        index: Place of the action in the action set; None for one that is not of the set.
        grounds: What it was chosen by: force (3,), N, and torque (3,), N m, of the observation, the features, and
            numbers of the policy's own.
        law: Control law of an action in six degrees of freedom; empty for a step across.
        spatial: What such an action does beside its step, (8,), as :class:`~palpate.core.policy.Spatial` has it.
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
    law: str = ""
    spatial: tuple[float, ...] = ()


@dataclass
class TrialTiming:
    """How regular the ticks and samples of a trial were; a simulator's always are.

    Attributes:
        worst_late_ns: Longest time by which a tick began after its slot.
        late_ticks: Ticks that began more than a millisecond late.
        repeated_samples: Ticks in which a sensor had nothing new.
    """

    worst_late_ns: int = 0
    late_ticks: int = 0
    skipped_slots: int = 0
    repeated_samples: int = 0


@dataclass
class TrialReport:
    """What came of a finished trial, from port data alone.

    Attributes:
        exploration_time_s: From contact to the hole (or to the end without it).
        peak_force_N: Largest norm of the measured force, tared, over the control ticks after taring.
        depth_m: Estimated depth of the tip below the plate's surface at the end.
        temperature: Exploration temperature during the trial; None for policies without one.
        trip: What the supervisor took over for; None while it did not.
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
"""Name of the event at the tick in which an interruption was first seen."""


class Purpose(enum.IntEnum):
    """What random numbers are drawn for. The values are part of every log: never renumber them."""

    START = 0
    HOLE = 1
    SENSOR = 2
    POLICY = 3
    PARTITION = 4
    FITTING = 5
    WALKS = 6
    HOLE_SHIFT = 7
    GRIP = 8
    ZERO = 9
    HIDDEN = 10
    PLATE = 11
    DITHER = 12


TRIALS_OF_A_SERIES: Final = 500_000
"""Each multiple of this begins a series of trials with random streams of its own: first those of training, then those
of evaluation, then those that fit a perception."""


def generator(seed: int, purpose: Purpose, trial: int) -> np.random.Generator:
    """The generator for one purpose of one trial."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(int(purpose), trial)))
