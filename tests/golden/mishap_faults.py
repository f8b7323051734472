"""Plans of faults at the ports, as mishaps name them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from tests.support.tool import TOOL

EXPLORING: Final = 150
"""A tick at which trial 0 explores."""
SOON: Final = {"tare_ticks": 8, "start_uncertainty_mm": 0.0}
"""Settings of the task with which it comes to the point soon."""


def force(kind: str, tick: int, **plan: Any) -> Mapping[str, Any]:
    """Of the force sensor, from a tick on."""
    return {"kind": kind, "port": "force_sensor", "first_tick": tick, **plan}


def joints(kind: str, tick: int, **plan: Any) -> Mapping[str, Any]:
    """Of the encoders."""
    return {"kind": kind, "port": "joint_encoder", "first_tick": tick, **plan}


def arm(kind: str, tick: int, **plan: Any) -> Mapping[str, Any]:
    """Of the arm."""
    return {"kind": kind, "port": "arm", "first_tick": tick, **plan}


def clock(kind: str, tick: int, **plan: Any) -> Mapping[str, Any]:
    """Of the clock."""
    return {"kind": kind, "port": "clock", "first_tick": tick, **plan}


def weak(**limits: Any) -> dict[str, Any]:
    """Limits of the supervisor, some of them weaker."""
    return {"supervision": limits}


def dead(tick: int) -> tuple[Mapping[str, Any], ...]:
    """A force sensor that gives its noise and nothing else."""
    forces, torques = (0, 1, 2), (3, 4, 5)
    return (
        force("unit", tick, factor=1e-4),
        force("noise", tick, magnitude=0.1, channels=forces),
        force("noise", tick, magnitude=0.004, channels=torques),
    )


def dead_across(tick: int) -> tuple[Mapping[str, Any], ...]:
    """One that gives its noise and nothing else across the tool axis."""
    return (
        force("unit", tick, factor=1e-4, channels=(0, 1, 3, 4)),
        force("noise", tick, magnitude=0.1, channels=(0, 1)),
        force("noise", tick, magnitude=0.004, channels=(3, 4)),
    )


def shove(tick: int, x_N: float, y_N: float, **more: Any) -> tuple[Mapping[str, Any], ...]:
    """A lateral force with the torque that it has at the tip."""
    lever_m = TOOL.tip_m[2]
    wrench = ((0, x_N), (1, y_N), (3, -lever_m * y_N), (4, lever_m * x_N))
    return tuple(force("offset", tick, magnitude=value, channels=(channel,), **more) for channel, value in wrench)
