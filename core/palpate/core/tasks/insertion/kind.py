"""What the rest of palpate has to know of insertions as a kind of task."""

from __future__ import annotations

from palpate.core.trial import TaskConfig, Workspace


def insertion_workspace(task: TaskConfig) -> Workspace:
    """Room for all starts, the exploration and the whole depth."""
    # Where the area is centred at the start, the two add up.
    side_mm = task.start_uncertainty_mm + task.area_half_width_mm
    return Workspace((side_mm, side_mm), task.ready_height_mm, task.insertion_depth_mm)
