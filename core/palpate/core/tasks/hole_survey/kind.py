"""A survey of holes as a kind of task, as the rest of palpate uses it."""

from collections.abc import Mapping
from math import nan
from typing import Any, Final

from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.motion import ArmDescription
from palpate.core.ports import Truth
from palpate.core.tasks.hole_survey.options import SurveyOptions
from palpate.core.tasks.hole_survey.surveyed_hole import SurveyedHole, surveyed
from palpate.core.tasks.hole_survey.task import SurveyPhase, SurveyTask
from palpate.core.trial import (
    Fit,
    Outcome,
    ReadyPose,
    TaskConfig,
    TaskKind,
    TaskParts,
    TrialReport,
    TrialSetup,
    Workspace,
    find_ready_pose,
    options_of,
)

_MORE_MM: Final = (40.0, 0.0, 0.0, 40.0)


class HoleSurvey(TaskKind):
    """A probe over a list of places; no policy is asked, and nothing is drawn for the core."""

    preset: Mapping[str, Any] = {
        "task": {
            "goal": {"x_mm": 410.0},
            "more_goals_mm": _MORE_MM,
            "area_half_width_mm": 9.0,
            "time_limit_s": 600.0,
            "max_force_N": 20.0,
        },
        "cell": {
            "peg": {"diameter_mm": 6.0, "clearance_mm": 2.0},
            "hole_uncertainty_mm": 4.0,
            "more_holes_mm": _MORE_MM,
        },
        # What ends a survey by its force latches.
        "supervision": {"max_force_N": 20.0},
    }
    asks_policy = False
    options = SurveyOptions
    phases = (*TaskKind.phases, *SurveyPhase)

    @override
    def workspace(self, task: TaskConfig) -> Workspace:
        own = options_of(SurveyOptions, task)
        places = [(0.0, 0.0), *task.more_places_m]
        room_mm = max(own.aside_mm, own.search_mm + 0.5 * (own.widest_mm - own.probe_mm))
        far_mm, across_mm = (1e3 * max(abs(place[axis]) for place in places) + room_mm for axis in (0, 1))
        return Workspace((far_mm, across_mm), task.ready_height_mm, own.deepest_mm)

    @override
    def ready(self, arm: str | ArmDescription, task: TaskConfig) -> ReadyPose:
        own = options_of(SurveyOptions, task)
        if own.push_N >= task.max_force_N:
            raise ConfigurationError(
                own.dotted("push_N"), own.push_N, f"less than task.max_force_N = {task.max_force_N:g}"
            )
        return find_ready_pose(arm, task, self.workspace(task))

    @override
    def setup(self, task: TaskConfig, seed: int, trial: int) -> TrialSetup:
        """From above the goal."""
        return TrialSetup(trial, seed, (0.0, 0.0))

    @override
    def make(self, parts: TaskParts) -> SurveyTask:
        return SurveyTask(parts.task, parts.control, parts.measurement, parts.motion)

    @override
    def achieved(self, task: TaskConfig, report: TrialReport, truth: Truth, fit: Fit) -> bool:
        """Every hole found, each number within the tolerance of the truth, the true peak force below the limit."""
        found = surveyed(report)
        return (
            report.outcome is Outcome.DONE
            and truth.peak_force_N < task.max_force_N
            and len(found) == 1 + len(task.more_places_m)
            and all(_off_mm(hole, truth, fit) <= options_of(SurveyOptions, task).tolerance_mm for hole in found)
        )

    @override
    def untrue(self, task: TaskConfig, report: TrialReport, truth: Truth, fit: Fit) -> bool:
        """A hole is said not to be there, or a number is off by more than the tolerance and its own interval."""
        found, within_mm = surveyed(report), options_of(SurveyOptions, task).tolerance_mm
        return report.outcome in (Outcome.DONE, Outcome.OUT_OF_TOLERANCE) and (
            len(found) <= len(task.more_places_m)
            or any(_off_mm(hole, truth, fit) > within_mm + hole.worst_mm for hole in found)
        )


HOLE_SURVEY: Final = HoleSurvey()


def _off_mm(hole: SurveyedHole, truth: Truth, fit: Fit) -> float:
    # What the axial spring gives is taken from the settings, as an insertion's depth: the surface's height holds that.
    return max(abs(error) for name, error in errors_mm(hole, truth, fit).items() if name != "surface")


def errors_mm(hole: SurveyedHole, truth: Truth, fit: Fit) -> dict[str, float]:
    """By how much each number of a surveyed hole is above the truth, by name.

    Args:
        hole: As it was found.
        truth: Holes beyond the first are among what was drawn.
        fit: How wide and deep they are.
    """
    x, y, z = (each * 1e3 for each in truth.hole_in_task_m)
    clearance_mm = truth.drawn.get("clearance_mm", fit.clearance_mm)
    if hole.number > 1:
        x, y = (truth.drawn.get(f"hole_{hole.number}_{axis}_mm", nan) for axis in "xy")
    true = {"x": x, "y": y, "diameter": fit.diameter_mm + 2.0 * clearance_mm, "depth": fit.depth_mm, "surface": z}
    return {name: float(getattr(hole, name).mm) - value for name, value in true.items()}
