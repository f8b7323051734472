"""A claim about a policy's trials, what they show of it, and how many it takes to show it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from math import ceil, log
from typing import Annotated, ClassVar

from palpate.adapters.experiments.results import TrialRow
from palpate.adapters.experiments.statistics import exact_interval
from palpate.core.ports import Range, Settings


@dataclass(frozen=True)
class Claim(Settings):
    """So many of all trials succeed, as their task has it, none of these with a greater true peak force."""

    TABLE: ClassVar[str] = "claim"

    success_percent: Annotated[float, Range(0.0, 100.0, above=True, below=True)] = 99.0
    """Share of trials that end well, at least."""
    force_N: Annotated[float, Range(0.1, 1000.0)] = 30.0
    """True peak force of a trial that ends well, at most."""
    confidence_percent: Annotated[float, Range(50.0, 99.999)] = 95.0
    """Confidence of the two-sided interval (Clopper and Pearson) that the verdict goes by."""

    @property
    def fewest(self) -> int:
        """So many trials are needed for the lower bound to reach the share where not one fails."""
        half = 0.5 * (1.0 - self.confidence_percent / 100.0)
        return ceil(log(half) / log(self.success_percent / 100.0))

    def holds(self, row: TrialRow) -> bool:
        """Whether a trial ended well."""
        return row.success and row.peak_force_N <= self.force_N

    def judge(self, rows: Sequence[TrialRow]) -> tuple[ClaimVerdict, tuple[float, float]]:
        """The verdict on these trials, and the interval of the share that it goes by."""
        good = sum(map(self.holds, rows))
        low, high = exact_interval(good, len(rows), self.confidence_percent / 100.0)
        share = self.success_percent / 100.0
        verdict = ClaimVerdict.PROVED if low >= share else ClaimVerdict.REFUTED if high < share else ClaimVerdict.OPEN
        return verdict, (low, high)

    def __str__(self) -> str:
        return (
            f"at least {self.success_percent:g} % of trials succeed with a true peak of at most"
            f" {self.force_N:g} N, at {self.confidence_percent:g} %"
        )


class ClaimVerdict(Enum):
    """What trials say of a claim."""

    PROVED = "proved"
    REFUTED = "refuted"
    OPEN = "neither proved nor refuted"
