"""Fault scenarios of the supervisor, the ports and the arm's limits: samples, forces, places, commands."""

from math import nan

from palpate.core.ports import CommandReason
from tests.golden.fault_plans import EXPLORING, arm, clock, force, joints, square, weak
from tests.golden.fault_scenario import FaultScenario

_VELOCITY, _POSITION = CommandReason.VELOCITY_LIMIT, CommandReason.POSITION_LIMIT
_EARLY = {"task": {"tare_ticks": 8, "ready_height_mm": 0.5}}
"""With these it explores in tick 84."""
_JUMPS = {"max_tracking_error_mrad": 500.0, "max_joint_velocity_share": 5.0}
"""Encoders may jump, so that the tip's place trips."""


def _walled(tick, joint, jump_rad, **margins):
    """Encoders place the tip outside the workspace."""
    fault = joints("spike", tick, magnitude=jump_rad, channels=(joint,))
    return FaultScenario("safety trip, WORKSPACE", (fault,), weak(**_JUMPS, **margins))


SAMPLES = {
    "trip-invalid": FaultScenario("sensor fault, SAMPLE_INVALID", (force("nan", 20),)),
    "trip-joints-invalid": FaultScenario("sensor fault, SAMPLE_INVALID", (joints("nan", 20),)),
    "trip-force-stale": FaultScenario("safety trip, SAMPLE_STALE", (force("delay", 20, delay_ticks=9),)),
    "trip-joints-stale": FaultScenario(
        "safety trip, SAMPLE_STALE", (joints("delay", 8, delay_ticks=18),), weak(max_tracking_error_mrad=400.0)
    ),
    "trip-clock-back": FaultScenario("safety trip, SAMPLE_STALE", (clock("clock-jump", 20, time_s=-0.5),)),
    "trip-late": FaultScenario("safety trip, LATE_CYCLE", (clock("overrun", 20, time_s=0.1),)),
    "trip-force-repeated": FaultScenario(
        "safety trip, SAMPLE_REPEATED", (force("repeat", 20, span_ticks=1),), {"supervision": {"max_repeats": 3}}
    ),
    "trip-frozen": FaultScenario("safety trip, SAMPLE_FROZEN", (force("freeze", 20),)),
    "trip-flat-channel": FaultScenario("safety trip, CHANNEL_FLAT", (force("freeze", 20, channels=(3,)),)),
    "trip-kind": FaultScenario("safety trip, WRENCH_CONTRACT", tared_from=20),
    "first-kind": FaultScenario("error, core", tared_from=0),
    "first-joints-invalid": FaultScenario("error, core", (joints("nan", 0),)),
    "force-sensor-gone": FaultScenario("error, port", (force("disconnect", 20),)),
    "encoders-gone": FaultScenario("error, port", (joints("disconnect", 20),)),
    "aborted": FaultScenario("error, outside", at=(20, "abort")),
}
"""Samples that are invalid, late, repeated, flat or missing."""

LIMITS = {
    "trip-force-tared": FaultScenario(
        "safety trip, FORCE_LIMIT", settings=weak(max_force_N=4.0, unexpected_contact_N=2.0)
    ),
    "trip-torque-tared": FaultScenario(
        "safety trip, TORQUE_LIMIT", (force("spike", 84, magnitude=9.0, channels=(3,)),), _EARLY
    ),
    # The sample is early and thus close to the one before.
    "trip-force-rate": FaultScenario(
        "safety trip, FORCE_RATE", (force("spike", 84, magnitude=26.0, channels=(0,)),), _EARLY, ahead={84: -2_000_000}
    ),
    # Two samples too close in time for a rate, two half a tick apart, and two around a repeated one.
    "close-samples": FaultScenario(
        "stopped from outside",
        (
            force("spike", 85, magnitude=10.0, channels=(0,), duration_ticks=1),
            force("repeat", 87, span_ticks=1, duration_ticks=2),
            force("spike", 88, magnitude=15.0, channels=(0,), duration_ticks=1),
        ),
        _EARLY,
        (92, "stop"),
        ahead={20: 7_140_000, 84: 4_100_000},
    ),
    "trip-contact": FaultScenario(
        "safety trip, UNEXPECTED_CONTACT",
        (force("spike", 20, magnitude=-3.0, channels=(0, 1, 2)),),
        {"perception": {"calibration": [1.1, 0.9, 1.2, 0.8, 1.3, 0.7]}},
    ),
    "trip-joint-position": FaultScenario(
        "safety trip, JOINT_POSITION", (joints("spike", 20, magnitude=5.0, channels=(2,)),)
    ),
    "trip-joint-velocity": FaultScenario(
        "safety trip, JOINT_VELOCITY",
        (joints("spike", 20, magnitude=0.4, channels=(3,)),),
        weak(max_tracking_error_mrad=500.0),
    ),
    "trip-tracking": FaultScenario(
        "safety trip, TRACKING_ERROR", (joints("spike", 20, magnitude=0.02, channels=(3,)),)
    ),
    "trip-workspace-x": _walled(20, 1, 0.13, side_margin_mm=1.0),
    "trip-workspace-top": _walled(20, 1, -0.13, height_margin_mm=1.0, side_margin_mm=200.0),
    "trip-workspace-bottom": _walled(20, 1, 0.12, side_margin_mm=200.0),
    "trip-turned": FaultScenario(
        "safety trip, WORKSPACE",
        (joints("spike", 20, magnitude=0.07, channels=(5,)),),
        {**square(most_yaw_deg=1.0), **weak(**_JUMPS)},
        policy="corner-first",
    ),
    "trip-area": FaultScenario(
        "safety trip, EXPLORATION_AREA",
        (joints("spike", EXPLORING, magnitude=0.0095, channels=(0,)),),
        weak(area_margin_mm=0.05),
    ),
}
"""Forces, torques, joints and places beyond their limits."""

COMMANDS = {
    "command-not-finite": FaultScenario("error, port", (arm("nan", 20),)),
    "answer-not-finite": FaultScenario("sensor fault, COMMAND_NOT_FINITE", answers={20: (4, nan, _POSITION)}),
    "trip-command-jumps": FaultScenario("safety trip, COMMAND_JUMP", answers={20: (4, 9.0, _POSITION)}),
    # Beyond a limit, further, and so that the way back is faster than a joint may move; stopped in that tick.
    "clamp-position": FaultScenario(
        "stopped from outside",
        settings=weak(max_tracking_error_mrad=500.0),
        answers={2: (4, 3.15, _POSITION), 3: (4, 3.175, _POSITION), 5: (3, 0.06, _VELOCITY)},
        at=(6, "stop"),
    ),
    "clamped-by-the-arm": FaultScenario(
        "time limit",
        answers={n: (3, 0.001, reason) for n, reason in ((4, _VELOCITY), (5, _VELOCITY), (30, _POSITION))},
        settings={"task": {"time_limit_s": 0.1}},
    ),
    "trip-and-hold": FaultScenario(
        "sensor fault, SAMPLE_INVALID", (force("nan", 20),), {"supervision": {"on_trip": "hold"}}
    ),
    "retract-far": FaultScenario(
        "sensor fault, SAMPLE_INVALID", (force("nan", 20),), weak(retract_mm=200.0, retract_speed_mm_s=1000.0)
    ),
    # A spike trips; then a force seems to hold the tool while it is retracted.
    "retract-held": FaultScenario(
        "force limit, FORCE_LIMIT",
        (force("spike", 5, magnitude=60.0, channels=(2,)), force("offset", 9, magnitude=60.0, channels=(2,))),
        weak(retract_mm=5.0),
    ),
    "interrupted": FaultScenario("interrupted", settings=_EARLY, at=(84, "interrupt")),
}
"""Commands that are refused, clamped, answered or stopped, and retractions."""
