"""Fault plans and settings of the fault scenarios."""

EXPLORING = 150
"""A tick at which trial 0 explores."""
SOON = {"tare_ticks": 8, "start_uncertainty_mm": 0.0}
"""Settings of the task for a short way to the hole."""


def force(kind, tick, **plan):
    """Fault of the force sensor, from a tick on."""
    return {"kind": kind, "port": "force_sensor", "first_tick": tick, **plan}


def joints(kind, tick, **plan):
    """Fault of the encoders."""
    return {"kind": kind, "port": "joint_encoder", "first_tick": tick, **plan}


def arm(kind, tick, **plan):
    """Fault of the arm."""
    return {"kind": kind, "port": "arm", "first_tick": tick, **plan}


def clock(kind, tick, **plan):
    """Fault of the clock."""
    return {"kind": kind, "port": "clock", "first_tick": tick, **plan}


def weak(**limits):
    """Limits of the supervisor, some of them weaker."""
    return {"supervision": limits}


def square(**options):
    """Settings of a square peg, inserted in six degrees of freedom."""
    task = {"name": "insertion-6dof", "tare_ticks": 7, "ready_height_mm": 1.0, "time_limit_s": 4.0}
    own = {"corners": 4.0, "corner_mm": 20.5, "inside_mm": 2.0} | options
    return {"task": task | {"start_uncertainty_mm": 0.5, "options": own}, "cell": {"peg": {"cross_section": "square"}}}


def dead(tick):
    """Force sensor that gives its noise and nothing else."""
    return (
        force("unit", tick, factor=1e-4),
        force("noise", tick, magnitude=0.1, channels=(0, 1, 2)),
        force("noise", tick, magnitude=0.004, channels=(3, 4, 5)),
    )
