"""Trials of the newer tasks in which something goes wrong on purpose, for the golden logs."""

from __future__ import annotations

from typing import Any, Final

from tests.golden.mishap import Mishap
from tests.golden.mishap_faults import force, joints, weak

_FOLLOWED: Final = weak(max_tracking_error_mrad=500.0, max_joint_velocity_share=5.0)
"""Encoders may jump."""


def _corner(**task: Any) -> dict[str, Any]:
    """A square peg by its first corner; what is given is over these."""
    own = {"corners": 4.0, "corner_mm": 20.5, "inside_mm": 2.0, "lean_deg": 3.0} | task.pop("options", {})
    settings: dict[str, Any] = {
        "name": "insertion-6dof", "ticks_per_action": 8, "tare_ticks": 7, "ready_height_mm": 1.0,
        "start_uncertainty_mm": 0.5, "insertion_depth_mm": 2.0, "options": own,
    }  # fmt: skip
    peg = {"cross_section": "square", "hole_depth_mm": 2.0}
    cell = {"peg": peg, "conditions": {"yaw_deg": 0.5}, "contacts": "searched"}
    return {"task": settings | task, "cell": cell, **_FOLLOWED}


NEWER_TASKS: Final[dict[str, Mishap]] = {
    "trip-turned": Mishap(
        (joints("spike", 20, magnitude=0.07, channels=(5,)),),
        _corner(options={"most_yaw_deg": 1.0}),
        policy="corner-first",
    ),
    # Held aside where it is to lean, and held down; at last it is upright and, by its encoders, hardly deep.
    "corner-lost": Mishap(
        (
            force("offset", 44, magnitude=4.5, channels=(0,), duration_ticks=12),
            force("offset", 61, magnitude=2.5, channels=(2,), duration_ticks=3),
            joints("offset", 148, magnitude=-0.0045, channels=(1,)),
        ),
        _corner(time_limit_s=2.0),
        (176, "stop"),
        policy="corner-first",
    ),
    # Encoders that are off hide the floor; withdrawn as if it were wedged, and on to the next corner.
    "corner-stuck": Mishap(
        (
            joints("offset", 140, magnitude=-0.003, channels=(1,)),
            force("offset", 474, magnitude=0.25, channels=(3,), duration_ticks=6),
        ),
        _corner(time_limit_s=3.4),
        policy="corner-first",
    ),
}
