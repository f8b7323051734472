"""Plans of faults at the ports, as mishaps name them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


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
