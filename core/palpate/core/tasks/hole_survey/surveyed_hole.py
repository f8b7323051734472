"""What came of the survey of one hole, and how it stands in a log: as the detail of an event."""

import re
from dataclasses import dataclass
from typing import Final, Self

from palpate.core.tasks.hole_survey.estimate import Sized
from palpate.core.trial import MEASURED, TrialReport

_NUMBER: Final = r"(-?[0-9.]+)"
_TOLD: Final = re.compile(
    rf"hole ([0-9]+): x {_NUMBER} \+- {_NUMBER}, y {_NUMBER} \+- {_NUMBER}, diameter {_NUMBER} \+- {_NUMBER}, "
    rf"depth {_NUMBER} \+- {_NUMBER}, surface {_NUMBER} \+- {_NUMBER} mm"
)


@dataclass(frozen=True, slots=True)
class SurveyedHole:
    """A hole as it was found.

    Attributes:
        number: Its place in the list of places, from 1.
        x: Centre, task frame; and so ``y``.
        diameter: Of the hole.
        depth: Of its floor below the plate's surface.
        surface: Of the plate's surface below the nominal plane.
    """

    number: int
    x: Sized
    y: Sized
    diameter: Sized
    depth: Sized
    surface: Sized

    @property
    def worst_mm(self) -> float:
        """The widest of the uncertainties, the surface's excepted: the depth's holds that."""
        return max(each.within_mm for each in (self.x, self.y, self.diameter, self.depth))

    def told(self) -> str:
        """The detail of its event."""
        return (
            f"hole {self.number}: x {self.x}, y {self.y}, diameter {self.diameter}, depth {self.depth},"
            f" surface {self.surface} mm"
        )

    @classmethod
    def of(cls, detail: str) -> Self | None:
        """The hole that such a detail is of; None of a hole that was not found."""
        if (found := _TOLD.fullmatch(detail)) is None:
            return None
        numbers = [float(each) for each in found.groups()[1:]]
        return cls(int(found[1]), *map(Sized, numbers[::2], numbers[1::2]))


def surveyed(report: TrialReport) -> list[SurveyedHole]:
    """The holes that a trial found."""
    return [hole for event in report.events if event.name == MEASURED and (hole := SurveyedHole.of(event.detail))]
