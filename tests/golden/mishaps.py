"""Trials in which something goes wrong on purpose, for the golden logs: every kind of trip, clamp, fault and end.

A mishap is a trial of the simulated cell over ports with faults, as short as it can be: what trips does so early, and
draws the tool back by little.
"""

from __future__ import annotations

from math import nan, pi
from typing import Any, Final

from palpate.core.ports import CommandReason
from tests.golden.mishap import Mishap
from tests.golden.mishap_faults import arm, clock, dead, force, joints, shove, weak
from tests.golden.mishaps_newer_tasks import NEWER_TASKS

_EXPLORING: Final = 150
"""A tick at which trial 0 explores."""
_TALL: Final = {"height_margin_mm": 1.0, "side_margin_mm": 200.0}
_WIDE: Final = {"side_margin_mm": 200.0}
_VELOCITY, _POSITION = CommandReason.VELOCITY_LIMIT, CommandReason.POSITION_LIMIT


def _near_walls(**margins: float) -> dict[str, Any]:
    """Encoders may jump, so that it is the tip's place that trips."""
    return weak(max_tracking_error_mrad=500.0, max_joint_velocity_share=5.0, **margins)


_SOON: Final = {"tare_ticks": 8, "start_uncertainty_mm": 0.0}
"""Settings of the task with which it comes to the point soon."""
_STRAIGHT_IN: Final = {
    "task": _SOON | {"insertion_depth_mm": 1.0, "surface_uncertainty_mm": 0.0},
    "cell": {"peg": {"hole_depth_mm": 1.0}},
}
_EDGE: Final[dict[str, Any]] = {
    "task": _SOON | {"insertion_depth_mm": 2.0},
    "cell": {"peg": {"hole_depth_mm": 2.0}},
}
_PLATE: Final = {"hole_uncertainty_mm": 3.0}
"""Of the cell: in trial 3 the plate is met beside the hole."""
_CALIBRATED: Final = {"perception": {"calibration": [1.1, 0.9, 1.2, 0.8, 1.3, 0.7]}}

MISHAPS: Final[dict[str, Mishap]] = {
    **NEWER_TASKS,
    "trip-invalid": Mishap((force("nan", 20),)),
    "trip-saturated": Mishap((force("saturate", 20, magnitude=0.1),)),
    "trip-joints-invalid": Mishap((joints("nan", 20),)),
    "trip-force-stale": Mishap((force("delay", 20, delay_ticks=9),)),
    "trip-joints-stale": Mishap((joints("delay", 8, delay_ticks=18),), weak(max_tracking_error_mrad=400.0)),
    "trip-force-repeated": Mishap((force("repeat", 20, span_ticks=1),), {"supervision": {"max_repeats": 3}}),
    "trip-joints-repeated": Mishap((joints("repeat", 2, span_ticks=1),), {"supervision": {"max_repeats": 3}}),
    "trip-repeated-by-turns": Mishap(
        (joints("repeat", 20, span_ticks=1, duration_ticks=1), force("repeat", 21, span_ticks=1)),
        {"supervision": {"max_repeats": 3}},
    ),
    "trip-frozen": Mishap((force("freeze", 20),)),
    "trip-late": Mishap((clock("overrun", 20, time_s=0.1),)),
    "trip-clock-back": Mishap((clock("clock-jump", 20, time_s=-0.5),)),
    "trip-force-untared": Mishap((force("spike", 20, magnitude=45.0, channels=(2,)),)),
    "trip-force-tared": Mishap(settings={"supervision": {"max_force_N": 4.0, "unexpected_contact_N": 2.0}}),
    "trip-torque": Mishap((force("spike", 20, magnitude=9.0, channels=(4,)),)),
    "trip-torque-tared": Mishap((force("spike", _EXPLORING, magnitude=9.0, channels=(3,)),)),
    "trip-force-rate": Mishap((force("spike", _EXPLORING, magnitude=30.0, channels=(0,)),)),
    "trip-contact-untared": Mishap((force("spike", 20, magnitude=4.0, channels=(1,)),)),
    "trip-contact-lift": Mishap((force("bias-drift", 3, magnitude=60.0, channels=(0,)),)),
    "trip-joint-position": Mishap((joints("spike", 20, magnitude=5.0, channels=(2,)),)),
    "trip-joint-position-low": Mishap((joints("spike", 20, magnitude=-5.0, channels=(1,)),)),
    "trip-joint-velocity": Mishap(
        (joints("spike", 20, magnitude=0.4, channels=(3,)),), weak(max_tracking_error_mrad=500.0)
    ),
    "trip-tracking": Mishap((joints("spike", 20, magnitude=0.02, channels=(3,)),)),
    "trip-tracking-stuck": Mishap((arm("stuck", 4),), trial=2),
    "trip-workspace-x": Mishap((joints("spike", 20, magnitude=0.13, channels=(1,)),), _near_walls(side_margin_mm=1.0)),
    "trip-workspace-y": Mishap((joints("spike", 20, magnitude=-0.08, channels=(0,)),), _near_walls()),
    "trip-workspace-top": Mishap((joints("spike", 20, magnitude=-0.13, channels=(1,)),), _near_walls(**_TALL)),
    "trip-workspace-bottom": Mishap((joints("spike", 20, magnitude=0.13, channels=(1,)),), _near_walls(**_WIDE)),
    "trip-area": Mishap(
        (joints("spike", _EXPLORING, magnitude=0.0095, channels=(0,)),), {"supervision": {"area_margin_mm": 0.05}}
    ),
    "command-not-finite": Mishap((arm("nan", 20),)),
    "trip-command-jumps": Mishap(answers={20: (4, 9.0, _POSITION)}),
    "trip-and-hold": Mishap((force("nan", 20),), {"supervision": {"on_trip": "hold"}}),
    "trip-then-stopped": Mishap((force("freeze", 20),), {"supervision": {"retract_mm": 5.0}}, (32, "stop")),
    "clamp-position": Mishap(
        settings=weak(max_tracking_error_mrad=500.0),
        answers={2: (4, 3.15, _POSITION), 3: (4, 3.15, _POSITION)},
        at=(20, "stop"),
    ),
    "clamped-and-followed": Mishap(
        settings=weak(max_tracking_error_mrad=500.0),
        answers={2: (4, 3.15, _POSITION), 3: (4, 3.14, CommandReason.AS_ASKED), 4: (4, 3.14, _POSITION)},
        at=(8, "stop"),
    ),
    "clamped-by-the-arm": Mishap(
        answers={n: (3, 0.001, reason) for n, reason in ((4, _VELOCITY), (5, _VELOCITY), (30, _POSITION))},
        settings={"task": {"time_limit_s": 0.1}},
    ),
    "stopped-from-outside": Mishap(at=(20, "stop")),
    "interrupted": Mishap(at=(_EXPLORING, "interrupt")),
    "interrupted-early": Mishap(at=(20, "interrupt")),
    "aborted": Mishap(at=(20, "abort")),
    "force-sensor-gone": Mishap((force("disconnect", 20),)),
    "encoders-gone": Mishap((joints("disconnect", 20),)),
    "arm-gone": Mishap((arm("disconnect", 20),)),
    "first-joints-invalid": Mishap((joints("nan", 0),)),
    "first-force-invalid": Mishap((force("nan", 0),)),
    "calibrated": Mishap(settings=_CALIBRATED),
    "calibrated-first-order": Mishap(
        settings={"perception": {**_CALIBRATED["perception"], "filter_order": 1}, "task": {"time_limit_s": 1.0}},
        trial=3,
    ),
    "calibrated-torque": Mishap((force("spike", _EXPLORING, magnitude=9.0, channels=(3, 4, 5)),), _CALIBRATED),
    "calibrated-misfit": Mishap((force("offset", _EXPLORING, magnitude=2.0, channels=(3, 4)),), _CALIBRATED),
    "calibrated-rate": Mishap((force("spike", _EXPLORING, magnitude=15.0, channels=(0, 1, 2)),), _CALIBRATED),
    "calibrated-contact": Mishap((force("spike", 20, magnitude=-3.0, channels=(0, 1, 2)),), _CALIBRATED),
    "calibrated-force": Mishap((force("spike", 20, magnitude=45.0, channels=(0, 1, 2)),), _CALIBRATED),
    "effort": Mishap(
        (
            force("offset", 76, magnitude=-1.0, channels=(2,)),
            force("offset", 76, magnitude=2.0, channels=(0,)),
            force("offset", 88, magnitude=3.0, channels=(2,), duration_ticks=1),
        ),
        {"learning": {"reinforcement": "effort"}, "task": {"tare_ticks": 8, "time_limit_s": 0.45}},
    ),
    "lies-pressing": Mishap(
        (force("spike", 110, magnitude=-4.0, channels=(2,)),), {"task": {"tare_ticks": 8, "time_limit_s": 0.6}}
    ),
    # The heave shows no force that follows, so a lift is made, and by then the sensor is sound again.
    "held-a-while": Mishap(
        (force("freeze", 96, channels=(2,), duration_ticks=14),),
        {"task": {"tare_ticks": 8, "ticks_per_action": 4, "time_limit_s": 0.55}},
    ),
    "irregular": Mishap(
        (
            clock("overrun", 5, time_s=0.01, probability=0.2),
            joints("duplicate", 5, probability=0.4),
            force("duplicate", 9, probability=0.2),
        ),
        {"task": {"time_limit_s": 0.8, "tare_ticks": 8}},
    ),
    "proportional": Mishap(
        settings={
            "control": {"force_proportional_m_per_N": 1e-5},
            "task": {"time_limit_s": 3.0, "tare_ticks": 8, "prove_contact": False},
        },
        at=(160, "stop"),
    ),
    "trip-area-start": Mishap(
        (joints("spike", _EXPLORING, magnitude=-0.0095, channels=(0,)),),
        {"supervision": {"area_margin_mm": 0.05}, "task": {"area_centre": "start"}},
        trial=2,
    ),
    "trip-area-x": Mishap(
        (joints("spike", _EXPLORING, magnitude=0.06, channels=(1,)),),
        {"task": {"area_centre": "start"}, **_near_walls(depth_margin_mm=200.0, height_margin_mm=200.0)},
        trial=2,
    ),
    "inserted-ur5": Mishap(settings={"arm": "ur5", "task": {"time_limit_s": 4.0, "insertion_depth_mm": 3.0}}),
    "inserted-blind": Mishap(
        settings={"task": {"time_limit_s": 6.0}, "cell": {"hole_uncertainty_mm": 3.0, "hole_height_error_mm": 0.3}},
        trial=1,
    ),
    "lies-dead-approach": Mishap(dead(0)),
    "lies-dead-explore": Mishap(dead(_EXPLORING), {"task": {"time_limit_s": 4.0}}),
    "lies-dead-in-the-hole": Mishap(dead(232), {"task": {"time_limit_s": 4.0}}),
    "lies-noisier": Mishap((force("noise", 20, magnitude=0.45),), {"supervision": {"max_noise_ratio": 2.0}}),
    "trip-kind": Mishap(tared_from=20),
    "first-kind": Mishap(tared_from=0),
    "first-joint-turned": Mishap((joints("offset", 0, magnitude=6.3, channels=(3,)),)),
    "trip-force-early": Mishap(ahead={20: 51_428_571, 30: 51_428_572}),
    "trip-workspace-x-low": Mishap(
        (joints("spike", 20, magnitude=-0.13, channels=(1,)),),
        _near_walls(side_margin_mm=1.0, height_margin_mm=300.0),
    ),
    "trip-workspace-y-low": Mishap((joints("spike", 20, magnitude=0.08, channels=(0,)),), _near_walls()),
    "answer-not-finite": Mishap(answers={20: (4, nan, _POSITION)}),
    "close-samples": Mishap(
        (
            clock("overrun", 5, time_s=0.0055, probability=0.5),
            force("spike", _EXPLORING, magnitude=9.0, channels=(0,)),
        ),
    ),
    "few-tared": Mishap((force("freeze", 30, channels=(3,)),), {"task": {"tare_ticks": 4}}),
    "seven-tared": Mishap((force("noise", 6, magnitude=1.0, channels=(1,)),), {"task": _SOON | {"tare_ticks": 7}},
        (40, "stop")),
    "no-torque-noise": Mishap(
        (force("freeze", 20, channels=(1,)),), {"cell": {"sensor": {"torque_noise_Nm": 0.0}}}
    ),
    "noiseless": Mishap((force("freeze", 20),), {"cell": {"sensor": {"torque_noise_Nm": 0.0, "force_noise_N": 0.0}},
        "task": {"time_limit_s": 0.1}}),
    "retract-far": Mishap((force("nan", 20),), weak(retract_mm=200.0, retract_speed_mm_s=1000.0)),
    "retract-fast": Mishap((force("nan", 20),), weak(retract_mm=20.0, retract_speed_mm_s=1000.0)),
    **{
        f"lies-flat-{name}": Mishap((force("freeze", 20, channels=(channel,)),))
        for name, channel in (("fx", 0), ("fy", 1), ("tx", 3), ("ty", 4), ("tz", 5))
    },
    "false-drop": Mishap(
        (force("offset", 156, magnitude=1.4, channels=(2,), duration_ticks=8),),
        {"task": {"time_limit_s": 0.9, "contact_kgf": 0.4}},
    ),
    "short-actions": Mishap(settings={"task": {"ticks_per_action": 4, "time_limit_s": 0.6}}),
    "above-plate": Mishap(
        (joints("offset", 115, magnitude=-0.003, channels=(1,)),),
        {"task": {"ticks_per_action": 8}, **weak(max_tracking_error_mrad=500.0)},
    ),
    "lies-dead-across": Mishap(
        (
            force("unit", 183, factor=1e-4, channels=(0, 1, 3, 4)),
            force("noise", 183, magnitude=0.1, channels=(0, 1)),
            force("noise", 183, magnitude=0.004, channels=(3, 4)),
        ),
        {"task": {"insertion_depth_mm": 3.0, "time_limit_s": 4.0}},
    ),
    "no-floor": Mishap(
        settings={
            "task": {"start_uncertainty_mm": 0.0, "insertion_depth_mm": 2.0},
            "cell": {"peg": {"hole_depth_mm": 10.0}},
        },
    ),
    "sinks-on-late": Mishap(
        (clock("overrun", 142, time_s=0.02),),
        {
            "task": {"start_uncertainty_mm": 1.2, "insertion_depth_mm": 2.0, "time_limit_s": 4.0},
            "cell": {"peg": {"hole_depth_mm": 10.0}},
        },
    ),
    "floor-too-soft": Mishap(
        settings={
            "task": {"start_uncertainty_mm": 0.0, "insertion_depth_mm": 2.0, "ready_height_mm": 0.5},
            "cell": {"peg": {"hole_depth_mm": 2.0}},
            "control": {"damping_N_s_per_m": 4000.0},
        },
    ),
    "lies-unsteady": Mishap(
        (
            force("offset", 174, magnitude=-1.2, channels=(2,)),
            force("offset", 286, magnitude=1.4, channels=(2,), duration_ticks=2),
            force("offset", 362, magnitude=1.0, channels=(2,), duration_ticks=1),
            *(force("offset", 233 + 70 * n, magnitude=-0.5, channels=(2,), duration_ticks=35) for n in range(3)),
        ),
        {"task": {"time_limit_s": 4.0}},
    ),
    **{
        f"lies-{name}": Mishap((fault,), {"task": {"time_limit_s": 4.0}})
        for name, fault in {
            "scaled-0.01": force("unit", 20, factor=0.01),
            "scaled-0.5": force("unit", 245, factor=0.5),
            "inverted": force("unit", 20, factor=-1.0),
            "flat-channel": force("freeze", 20, channels=(2,)),
            "recurring": force("repeat", 40, span_ticks=20, honest=False),
            "recurring-late": force("repeat", 66, span_ticks=62, honest=False),
            "noisy": force("noise", 20, magnitude=1.0),
            "swapped": force("swap", 20, channels=(0, 2)),
            "torque-scaled": force("unit", _EXPLORING, factor=5.0, channels=(3, 4)),
            "pulled": force("offset", _EXPLORING, magnitude=12.0, channels=(2,)),
            "drifting": force("bias-drift", _EXPLORING, magnitude=4.0, channels=(2,)),
            "dead": force("unit", 120, factor=0.0001),
        }.items()
    },
    "straight-in": Mishap(settings=_STRAIGHT_IN),
    "unproved": Mishap(
        settings={
            "task": {
                "tare_ticks": 8, "insertion_depth_mm": 1.0, "prove_contact": False, "start_uncertainty_mm": 2.5,
                "ready_height_mm": 1.0,
            },
            "cell": {"peg": {"hole_depth_mm": 1.0}},
        }
    ),
    "inserted-late": Mishap(
        (clock("overrun", 72, time_s=0.1),), {**_STRAIGHT_IN, "task": _SOON | {"insertion_depth_mm": 1.0}}
    ),
    "edge": Mishap((force("offset", 55, magnitude=-2.5, channels=(2,), duration_ticks=6),), _EDGE),
    "edge-high": Mishap(
        (force("offset", 38, magnitude=-2.5, channels=(2,), duration_ticks=6),),
        {**_EDGE, "cell": _EDGE["cell"] | {"hole_height_error_mm": 1.0}},
    ),
    "no-contact": Mishap((force("unit", 0, factor=0.01),), {"task": {"insertion_depth_mm": 0.5}}),
    "leaning": Mishap(settings={"cell": {"tilt_mrad": 2.0, "tilt_heading_deg": 40.0}}),
    "noisy-at-rest": Mishap((force("noise", 6, magnitude=1.0, channels=(1,)),), {"task": _SOON}),
    "lift-low": Mishap(
        (
            joints("offset", 0, magnitude=0.006, channels=(1,)),
            # What was borne while the tool was lifted out is no contact afterwards.
            force("offset", 0, magnitude=4.0, channels=(0,), duration_ticks=2),
        ),
        {"task": _SOON},
        (26, "stop"),
    ),
    "placed": Mishap(settings={"task": _SOON}, at=(20, "stop"), placed=True),
    "lies-dead-borne": Mishap(
        (
            force("unit", 75, factor=1e-4, channels=(2,)),
            force("noise", 75, magnitude=0.1, channels=(2,)),
            force("offset", 75, magnitude=1.05, channels=(2,)),
        ),
        {"task": {"tare_ticks": 8, "ticks_per_action": 60, "time_limit_s": 1.0}},
        (100, "stop"),
    ),
    "lost-at-once": Mishap(
        (force("offset", 75, magnitude=5.0, channels=(2,)),), {"task": {"tare_ticks": 8}}, (82, "stop")
    ),
    "pressing-lightly": Mishap(
        (force("offset", 84, magnitude=2.6, channels=(2,)),), {"task": {"tare_ticks": 8, "time_limit_s": 0.4}}
    ),
    "shallow": Mishap(
        settings={
            "task": {
                "tare_ticks": 8, "insertion_depth_mm": 0.5, "time_limit_s": 4.0, "surface_uncertainty_mm": 0.0,
                "depth_tolerance_mm": 0.05, "ready_height_mm": 0.5, "press_kgf": 0.14, "contact_kgf": 0.06,
            },
            "control": {"damping_N_s_per_m": 1000.0},
        }
    ),
    "lies-dead-across-soon": Mishap(
        (
            force("unit", 128, factor=1e-4, channels=(0, 1, 3, 4)),
            force("noise", 128, magnitude=0.1, channels=(0, 1)),
            force("noise", 128, magnitude=0.004, channels=(3, 4)),
        ),
        {"task": {"tare_ticks": 8, "time_limit_s": 4.0, "play_mm": 0.01}},
    ),
    **{
        f"freed-{name}": Mishap(
            tuple(force("offset", tick, magnitude=-1.4, channels=(2,), **more) for tick, more in offsets),
            {"task": _SOON | {"time_limit_s": 4.0}},
            (100, "stop"),
        )
        for name, offsets in {
            "by-three": ((74, {}),),
            "by-two": ((73, {}),),
            "by-three-later": ((73, {"duration_ticks": 1}), (77, {})),
        }.items()
    },
    "fast-wrist": Mishap(
        (joints("spike", 20, magnitude=0.05443, channels=(5,)),),
        {"arm": "ur5", "task": _SOON, **weak(max_tracking_error_mrad=500.0)},
        (24, "stop"),
    ),
    "wrist-back": Mishap(
        settings={"arm": "ur5", "task": _SOON, **weak(max_tracking_error_mrad=500.0)},
        at=(30, "stop"),
        answers={20: (5, 0.04, _VELOCITY)},
    ),
    # A spike trips; then something seems to hold the tool that is drawn back.
    "retract-held": Mishap(
        (force("spike", 5, magnitude=60.0, channels=(2,)), force("offset", 9, magnitude=60.0, channels=(2,)))
    ),
    "retract-blocked": Mishap(
        (force("nan", 5), arm("stuck", 5)),
        {"arm": "ur5", **weak(retract_mm=20.0, retract_speed_mm_s=500.0, max_tracking_error_mrad=500.0)},
        answers={4: (4, pi, _VELOCITY)},
    ),
    "too-slow": Mishap(
        settings={
            "task": _SOON | {"insertion_depth_mm": 30.0, "ready_height_mm": 0.5},
            "cell": {"peg": {"hole_depth_mm": 40.0}, "sensor": {"torque_noise_Nm": 0.0, "force_noise_N": 0.0}},
            "control": {"damping_N_s_per_m": 4000.0},
        }
    ),
    # Recordings that are too short to count, with live samples between them.
    "recurring-twice": Mishap(
        tuple(force("repeat", tick, span_ticks=20, honest=False, duration_ticks=5) for tick in (40, 52)),
        {"task": _SOON},
        (62, "stop"),
    ),
    # A sample that comes again under its own number is no channel that stays where it is.
    "repeated-for-short": Mishap(
        (force("repeat", 20, span_ticks=1, duration_ticks=12),),
        {"task": _SOON, **weak(flat_line_samples=10, max_force_age_ms=200.0)},
        (36, "stop"),
    ),
    # Two samples so close in time that their noise would be a rate.
    "samples-close": Mishap(settings={"task": _SOON}, at=(26, "stop"), ahead={20: 7_140_000}),
    # Too fast over two ticks, and not over the four that count.
    "fast-at-once": Mishap(
        (joints("spike", 2, magnitude=0.024, channels=(3,), duration_ticks=1),),
        {"task": _SOON, **weak(max_tracking_error_mrad=500.0)},
        (16, "stop"),
    ),
    "inserted-panda": Mishap(
        settings={
            "arm": "panda",
            # Far from where the arm's posture points: each step goes there as far as it may.
            "task": _SOON | {"goal": {"x_mm": 320.0, "y_mm": 420.0}, "insertion_depth_mm": 2.0, "ready_height_mm": 2.0},
            "cell": {"peg": {"hole_depth_mm": 2.0}},
        }
    ),
    # The force follows each heave too late to be believed, a lift shows why, and it is believed from then on.
    "late-force": Mishap(
        (
            force("delay", 20, delay_ticks=6),
            # Half the force, with the tare as it was, counts as late, too.
            force("unit", 150, factor=0.5, channels=(2,)),
            force("offset", 150, magnitude=2.6185, channels=(2,)),
        ),
        {"task": {"tare_ticks": 8, "time_limit_s": 2.5, "ticks_per_action": 30}, "cell": _PLATE},
        (200, "stop"),
        trial=3,
    ),
    # The arm stands still while the tool is to be lifted.
    "lift-stuck": Mishap(
        (arm("stuck", 128),), {"task": {"tare_ticks": 8, "ticks_per_action": 30}, "cell": _PLATE}, trial=3
    ),
    # A touch of too few samples, and too weak a press before the lift that follows; a touch of too short a way.
    "slipped": Mishap(
        (
            force("offset", 87, magnitude=2.8, channels=(2,), duration_ticks=1),
            force("offset", 97, magnitude=2.4, channels=(2,)),
        ),
        {"task": {"tare_ticks": 8, "contact_kgf": 0.03}, "cell": _PLATE},
        (130, "stop"),
        trial=3,
    ),
    "few-touched": Mishap(
        (force("offset", 85, magnitude=2.7, channels=(2,), duration_ticks=1),),
        {"task": {"tare_ticks": 8, "contact_kgf": 0.03}, "cell": _PLATE},
        (100, "stop"),
        trial=3,
    ),
    # Forces from before the first place that is kept, and after the last.
    "late-force-slow": Mishap(
        (force("delay", 3, delay_ticks=3),),
        {
            "task": {"tare_ticks": 8, "ready_height_mm": 0.5, "ticks_per_action": 60},
            "cell": _PLATE,
            "control": {"damping_N_s_per_m": 4000.0},
        },
        (200, "stop"),
        trial=3,
    ),
    # A sign of life, a check because the way was long, and then a force that does not follow.
    "late-joints": Mishap(
        (joints("delay", 3, delay_ticks=4), force("freeze", 196, channels=(2,), duration_ticks=17)),
        {"task": {"tare_ticks": 8}, "cell": _PLATE},
        (224, "stop"),
        trial=3,
    ),
    # The first force of a trial is no change of force.
    "heavy-tool": Mishap((force("offset", 0, magnitude=30.0, channels=(2,)),), {"task": _SOON}, (4, "stop")),
    # A lateral force that seems to come from the tip leads the tool as far aside as a wall can be, and half back.
    "shoved": Mishap(
        (*shove(90, 8.0, 16.0), *shove(122, 0.5, -12.0)), {"task": _SOON | {"play_mm": 0.1}}, (130, "stop")
    ),
    "surface-interrupted": Mishap(
        settings={"task": _SOON | {"name": "surface-follow", "options": {"stroke_mm": 14.0}}}, at=(12, "interrupt")
    ),
    # Borne by less than a peg rests with, which shows when the tool is held.
    "freed-at-rest": Mishap(
        (force("offset", 72, magnitude=-1.5, channels=(2,)),),
        {"task": _SOON | {"contact_kgf": 0.1, "insertion_depth_mm": 4.0}, "cell": {"peg": {"hole_depth_mm": 4.0}}},
    ),
}  # fmt: skip
