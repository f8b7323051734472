"""Trials of the newer tasks in which something goes wrong on purpose, for the golden logs."""

from __future__ import annotations

from typing import Any, Final

from tests.golden.mishap import Mishap
from tests.golden.mishap_faults import arm, dead, force, joints, shove, weak

_FOLLOWED: Final = weak(max_tracking_error_mrad=500.0, max_joint_velocity_share=5.0)
"""Encoders may jump."""


def _corner(hole_uncertainty_mm: float = 0.0, **task: Any) -> dict[str, Any]:
    """A square peg by its first corner; what is given is over these."""
    own = {"corners": 4.0, "corner_mm": 20.5, "inside_mm": 2.0, "lean_deg": 3.0, "down_share": 0.5} | task.pop(
        "options", {}
    )
    settings: dict[str, Any] = {
        "name": "insertion-6dof", "ticks_per_action": 8, "tare_ticks": 7, "ready_height_mm": 1.0,
        "start_uncertainty_mm": 0.5, "insertion_depth_mm": 2.0, "options": own,
    }  # fmt: skip
    peg = {"cross_section": "square", "hole_depth_mm": 2.0}
    cell = {"peg": peg, "conditions": {"yaw_deg": 0.5}, "contacts": "searched"}
    cell["hole_uncertainty_mm"] = hole_uncertainty_mm
    return {"task": settings | task, "cell": cell, **_FOLLOWED}


def _turned(travel_speed_mm_s: float = 20.0, **options: float) -> dict[str, Any]:
    """A square peg whose hole is turned further than a peg that is let in may lean."""
    own = dict(options)
    corner = _corner(ticks_per_action=6, time_limit_s=3.0, travel_speed_mm_s=travel_speed_mm_s, options=own)
    return {**corner, "cell": {**corner["cell"], "conditions": {"yaw_deg": 3.0}}}


def _triangle() -> dict[str, Any]:
    corner = _corner(time_limit_s=3.0, options={"corners": 3.0, "corner_mm": 20.0})
    corner["cell"]["peg"]["cross_section"] = "triangle"
    return corner


def _keyed() -> dict[str, Any]:
    own = {"corners": 0.0, "flat_deg": 37.5, "corner_mm": 11.5, "lean_deg": 6.0, "down_share": 0.75}
    corner = _corner(5.0, ticks_per_action=6, time_limit_s=4.0, options=own)
    corner["cell"]["peg"]["cross_section"] = "keyed"
    corner["cell"]["conditions"] = {"yaw_deg": 2.0}
    return corner


def _give_way(**task: Any) -> dict[str, Any]:
    """A round peg in a grip that may give way."""
    settings = {"name": "insertion-6dof", "ticks_per_action": 8, "tare_ticks": 7, "ready_height_mm": 1.0}
    cell = {"peg": {"hole_depth_mm": 2.0}, "contacts": "searched"}
    return {"task": settings | {"insertion_depth_mm": 2.0} | task, "cell": cell}


def _pushed(**options: float) -> dict[str, Any]:
    """On the edge of what may be explored; a force sensor may repeat itself."""
    own = {"push_N": 2.0, "inside_mm": 0.5} | options
    corner = _corner(1.5, area_half_width_mm=0.5, ticks_per_action=5, ready_height_mm=0.5, options=own)
    return {**corner, **weak(max_repeats=40, max_force_age_ms=300.0)}


NEWER_TASKS: Final[dict[str, Mishap]] = {
    "trip-turned": Mishap(
        (joints("spike", 20, magnitude=0.07, channels=(5,)),),
        _corner(options={"most_yaw_deg": 1.0}),
        policy="corner-first",
    ),
    "trip-leant": Mishap(
        (joints("spike", 20, magnitude=-0.09, channels=(4,)),),
        _corner(options={"most_lean_deg": 3.0, "most_yaw_deg": 10.0}),
        policy="corner-first",
    ),
    # Held aside where it is to lean, and held down, there and where it pushes; at last it is upright and, by its
    # encoders, hardly deep.
    "corner-lost": Mishap(
        (
            *shove(44, 6.0, 0.5, duration_ticks=16),
            force("offset", 61, magnitude=2.5, channels=(2,), duration_ticks=3),
            force("offset", 100, magnitude=6.0, channels=(2,), duration_ticks=2),
            joints("offset", 148, magnitude=-0.0045, channels=(1,)),
        ),
        _corner(time_limit_s=2.0),
        (176, "stop"),
        policy="corner-first",
    ),
    # Three samples until it pushes, then past where the hole was thought to be, on the edge of what may be explored; at
    # the next corner a force along the push, which only a wall can answer, and against it.
    "corner-pulled": Mishap(
        (force("repeat", 41, span_ticks=1, duration_ticks=21), *shove(107, -1.7, 1.7)),
        _pushed(),
        policy="corner-first",
        trial=13,
    ),
    # The same against the next push, so that it is doubted as an action is chosen.
    "corner-pulled-first": Mishap(
        (force("repeat", 41, span_ticks=1, duration_ticks=21), *shove(107, -4.0, -4.0)),
        _pushed(),
        policy="corner-first",
        trial=13,
    ),
    # The springs may come to so little that what a heave begins with, answered or not, decides whether it waits.
    "corner-answered": Mishap(
        (force("repeat", 41, span_ticks=1, duration_ticks=21), *shove(107, -4.0, -4.0)),
        _pushed(),
        (428, "stop"),
        policy="corner-first",
        trial=13,
    ),
    # A tool that is not as heavy as its setting says, which the trip names.
    "corner-other-tool": Mishap(settings=_corner(options={"tool_kg": 1.0}, time_limit_s=4.0), policy="corner-first"),
    # A look whose friction acts a little the wrong way round.
    "corner-answered-soon": Mishap(
        (force("repeat", 41, span_ticks=1, duration_ticks=21),),
        _pushed(),
        (106, "stop"),
        policy="corner-first",
        trial=7,
    ),
    # Encoders that are off hide the floor; it wobbles, is withdrawn as if it were wedged, and on to the next corner.
    "corner-stuck": Mishap(
        (
            joints("offset", 152, magnitude=-0.003, channels=(1,)),
            force("offset", 474, magnitude=0.25, channels=(3,), duration_ticks=6),
        ),
        _corner(time_limit_s=3.4),
        policy="corner-first",
    ),
    # Too little force, and a noise in which it does not scatter: it heaves, and the force follows. Then noise and no
    # force: it stops, heaves, and nothing follows.
    "corner-dead": Mishap(
        (
            force("unit", 60, factor=0.4, duration_ticks=50),
            force("unit", 110, factor=1e-4),
            force("noise", 0, magnitude=0.15, channels=(0, 1, 2)),
            force("noise", 0, magnitude=0.006, channels=(3, 4, 5)),
        ),
        _corner(time_limit_s=2.0),
        policy="corner-first",
    ),
    # It heaves on its way in uneven strokes: nothing answers for a while, then the force does, then no more. At this
    # speed the encoders' steps just ask for places further apart, in the next log just not; the springs come just to
    # more than they may, and there, at first, just not.
    "corner-unanswered": Mishap(
        (
            force("repeat", 100, span_ticks=1, duration_ticks=1),
            force("noise", 0, magnitude=0.1, channels=(0, 1, 2)),
            *({**fault, "duration_ticks": 40} for fault in dead(110)),
            *dead(190),
        ),
        _corner(time_limit_s=4.0, travel_speed_mm_s=14.5),
        policy="corner-first",
    ),
    # Where it waits a wall seems to be met on the way back; then the arm stands still, whatever heave is commanded, and
    # as it is stopped the supervisor leads it on no faster than its joints may go.
    "corner-unmoved": Mishap(
        (
            force("noise", 0, magnitude=0.1, channels=(0, 1, 2)),
            *dead(90),
            *shove(90, -5.0, -5.0, duration_ticks=3),
            arm("stuck", 95),
        ),
        _corner(time_limit_s=4.0, travel_speed_mm_s=15.6),
        (131, "stop"),
        policy="corner-first",
    ),
    # It stands still as soon as it pushes: what it shows of a heave is judged by as few samples as tell it.
    "corner-unmoved-soon": Mishap(
        (force("noise", 0, magnitude=0.1, channels=(0, 1, 2)), *dead(74), arm("stuck", 74)),
        _corner(travel_speed_mm_s=15.6),
        (106, "stop"),
        policy="corner-first",
    ),
    # Encoders so late that it gives way more slowly; pulled up, and along its first push from the beginning; so fast
    # that no stroke of a heave is short enough.
    "corner-late-joints": Mishap(
        (
            joints("delay", 20, delay_ticks=2),
            *shove(75, -3.0, -3.0),
            force("offset", 75, magnitude=6.0, channels=(2,), duration_ticks=2),
        ),
        _corner(time_limit_s=3.0, travel_speed_mm_s=30.0),
        policy="corner-first",
    ),
    # Walls that are not at right angles; as it stands upright, its encoders say that it is on the plate.
    "corner-triangle": Mishap(
        (joints("offset", 150, magnitude=-0.002, channels=(1,)),), _triangle(), (157, "stop"), policy="corner-first"
    ),
    # Both of them seem to carry when it has pushed once.
    "corner-quiet-at-once": Mishap(shove(72, 2.5, 4.3), _triangle(), (86, "stop"), policy="corner-first"),
    # It was left turned, and is put upright on its way.
    "corner-left-turned": Mishap(
        (joints("offset", 0, magnitude=0.05, channels=(5,)), joints("offset", 0, magnitude=-0.03, channels=(4,))),
        _corner(),
        (10, "stop"),
        policy="corner-first",
    ),
    # Among the forces that answer are two that are older than those before them.
    "corner-answered-before": Mishap(
        settings=_corner(),
        at=(102, "stop"),
        ahead={80: -45_000_000, 95: -30_000_000},
        policy="corner-first",
    ),
    # A flat that is met on the plate, and once more aside; pulled while it is lifted.
    "corner-flat-aside": Mishap(
        (force("offset", 62, magnitude=3.4, channels=(2,), duration_ticks=3),),
        _keyed(),
        (140, "stop"),
        policy="corner-first",
        trial=1,
    ),
    # It turns by 3 degrees before it is inserted; a torque that nothing gives leans it in the hole, further than it can
    # lean there, and would do so as it is drawn back.
    "corner-turned": Mishap(
        (
            joints("offset", 170, magnitude=-0.0002, channels=(1,)),
            force("unit", 188, factor=0.01, channels=(3, 4)),
            force("noise", 188, magnitude=0.004, channels=(3, 4)),
            force("offset", 188, magnitude=0.2, channels=(3,)),
            force("offset", 188, magnitude=0.15, channels=(4,)),
            force("offset", 188, magnitude=-2.0, channels=(2,)),
        ),
        _turned(insert_tilt_rad_per_Nms=1.0),
        (277, "stop"),
        policy="corner-first",
    ),
    # So slow that encoders' steps hide more of a heave, and places are taken further apart, but not so far as may be.
    "corner-slow": Mishap(settings=_turned(travel_speed_mm_s=3.6), at=(260, "stop"), policy="corner-first"),
    # The plate is lost for three ticks while the tool gives way, so that the filter shows next to no force as a step is
    # chosen; and a tool that seems deep in the last tick of that step and the first of the next one is not sunk yet.
    "give-way-lost": Mishap(
        (
            force("offset", 59, magnitude=17.0, channels=(2,), duration_ticks=3),
            joints("offset", 74, magnitude=0.0015, channels=(1,), duration_ticks=2),
        ),
        {**_give_way(start_uncertainty_mm=1.0), **_FOLLOWED},
        (76, "stop"),
        policy="hypotheses",
        trial=2,
    ),
    # A torque that nothing gives turns it further than it may lean, and the next step back; it heaves by less, or it
    # would come near the force limit.
    "given-way-far": Mishap(
        (
            force("offset", 55, magnitude=0.2, channels=(3,), duration_ticks=30),
            force("offset", 55, magnitude=0.3, channels=(4,), duration_ticks=30),
        ),
        _give_way(
            max_force_N=6.6,
            ticks_per_action=16,
            start_uncertainty_mm=1.0,
            options={"most_lean_deg": 1.0, "lean_deg": 1.0, "give_tilt_rad_per_Nms": 1.0},
        ),
        (84, "stop"),
        policy="hypotheses",
        trial=2,
    ),
    # A torque that does not settle, so that it is waited for it no longer.
    "seated-late": Mishap(
        (force("offset", 66, magnitude=0.05, channels=(3,)),),
        _give_way(start_uncertainty_mm=0.0, options={"insert_tilt_rad_per_Nms": 0.0}),
        policy="hypotheses",
    ),
    # A force along the axis that nothing gives leads the peg out again, as it seats and on what was the floor.
    **{
        f"led-out-{name}": Mishap(
            (force("offset", tick, magnitude=magnitude, channels=(2,)),),
            _give_way(start_uncertainty_mm=0.0),
            policy="hypotheses",
        )
        for name, tick, magnitude in (("seating", 63, -14.0), ("of-the-floor", 176, -11.0))
    },
}
