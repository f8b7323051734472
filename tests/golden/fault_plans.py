"""Fault plans and settings of the fault scenarios."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

EXPLORING: Final = 150
"""A tick at which trial 0 explores."""
SOON: Final = {"tare_ticks": 8, "start_uncertainty_mm": 0.0}
"""Settings of the task for a short way to the hole."""


def force(kind: str, tick: int, **plan: Any) -> Mapping[str, Any]:
    """Fault of the force sensor, from a tick on."""
    return {"kind": kind, "port": "force_sensor", "first_tick": tick, **plan}


def joints(kind: str, tick: int, **plan: Any) -> Mapping[str, Any]:
    """Fault of the encoders."""
    return {"kind": kind, "port": "joint_encoder", "first_tick": tick, **plan}


def arm(kind: str, tick: int, **plan: Any) -> Mapping[str, Any]:
    """Fault of the arm."""
    return {"kind": kind, "port": "arm", "first_tick": tick, **plan}


def clock(kind: str, tick: int, **plan: Any) -> Mapping[str, Any]:
    """Fault of the clock."""
    return {"kind": kind, "port": "clock", "first_tick": tick, **plan}


def weak(**limits: Any) -> dict[str, Any]:
    """Limits of the supervisor, some of them weaker."""
    return {"supervision": limits}


def square(**options: float) -> dict[str, Any]:
    """Settings of a square peg, inserted in six degrees of freedom."""
    task = {"name": "insertion-6dof", "tare_ticks": 7, "ready_height_mm": 1.0, "time_limit_s": 4.0}
    own = {"corners": 4.0, "corner_mm": 20.5, "inside_mm": 2.0} | options
    return {
        "task": task | {"start_uncertainty_mm": 0.5, "options": own},
        "cell": {"peg": {"cross_section": "square"}},
    }


def dead(tick: int) -> tuple[Mapping[str, Any], ...]:
    """Force sensor that gives its noise and nothing else."""
    return (
        force("unit", tick, factor=1e-4),
        force("noise", tick, magnitude=0.1, channels=(0, 1, 2)),
        force("noise", tick, magnitude=0.004, channels=(3, 4, 5)),
    )
