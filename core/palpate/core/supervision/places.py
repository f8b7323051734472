"""Is the tip where it may be?"""

from __future__ import annotations

from palpate.core.supervision.values import Expectation, Trip, TripReason
from palpate.core.supervision_config import SupervisionConfig
from palpate.core.task_config import TaskConfig
from palpate.core.values import Vector3


class PlaceWatch:
    """The tip against the workspace, a box in the task frame, and against the exploration area.

    Args:
        config: The margins.
        task: What the box has to hold: all starts, the exploration, the whole depth.
    """

    def __init__(self, config: SupervisionConfig, task: TaskConfig) -> None:
        # Where the area is centred at the start, the two add up.
        self._side_m = (task.start_uncertainty_mm + task.area_half_width_mm + config.side_margin_mm) * 1e-3
        self._top_m = -(task.ready_height_mm + config.height_margin_mm) * 1e-3
        self._bottom_m = (task.insertion_depth_mm + config.depth_margin_mm) * 1e-3
        self._margin_m = config.area_margin_mm * 1e-3

    def trip(self, tick: int, tip_m: Vector3, expectation: Expectation) -> Trip | None:
        """What is wrong with the tip's place; None if nothing is.

        Args:
            tick: Control tick of the trial.
            tip_m: Tip according to the encoders, (3,), task frame.
            expectation: Says whether the task explores, and where.
        """
        x, y, z = tip_m
        side = self._side_m
        # Written so that a number that is none trips, too.
        if not -side <= x <= side:
            return _left_workspace(tick, "x", x, -side, side)
        if not -side <= y <= side:
            return _left_workspace(tick, "y", y, -side, side)
        if not self._top_m <= z <= self._bottom_m:
            return _left_workspace(tick, "z", z, self._top_m, self._bottom_m)
        area = expectation.area
        if area is None:
            return None
        (cx, cy), most = area.centre_m, area.half_width_m + self._margin_m
        if -most <= x - cx <= most and -most <= y - cy <= most:
            return None
        value, limit = max(abs(x - cx), abs(y - cy)) * 1e3, most * 1e3
        text = f"tip {value:.2f} mm from the centre of the exploration area, limit {limit:g} mm"
        return Trip(TripReason.EXPLORATION_AREA, tick, value, limit, text)


def _left_workspace(tick: int, axis: str, place_m: float, low_m: float, high_m: float) -> Trip:
    value, limit = place_m * 1e3, (low_m if place_m < low_m else high_m) * 1e3
    text = f"tip at {axis} = {value:.2f} mm in the task frame, the workspace ends at {limit:g} mm"
    return Trip(TripReason.WORKSPACE, tick, value, limit, text)
