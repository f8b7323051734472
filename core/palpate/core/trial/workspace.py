"""The part of the world that a task is done in."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Workspace:
    """A box in the task frame; a supervisor lets the tip leave it by its margins and no further.

    Attributes:
        turns_deg: How far the tool may lean, and how far turn about its axis; None where it keeps its orientation, and
            nothing is held against that.
    """

    side_mm: tuple[float, float]
    above_mm: float
    below_mm: float
    turns_deg: tuple[float, float] | None = None
