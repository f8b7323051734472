"""What the supervisor, the ports and the arm's limits meet: samples, forces, places and commands that trip or clamp."""

from __future__ import annotations

from math import nan, pi
from typing import Any, Final

from palpate.core.ports import CommandReason
from tests.golden.mishap import Mishap
from tests.golden.mishap_faults import EXPLORING, SOON, arm, clock, force, joints, weak

_TALL: Final = {"height_margin_mm": 1.0, "side_margin_mm": 200.0}
_WIDE: Final = {"side_margin_mm": 200.0}
_VELOCITY, _POSITION = CommandReason.VELOCITY_LIMIT, CommandReason.POSITION_LIMIT
_EARLY: Final = {"task": {"tare_ticks": 8, "ready_height_mm": 0.5}}
"""With these it explores in tick 84."""
_CALIBRATED: Final = {"perception": {"calibration": [1.1, 0.9, 1.2, 0.8, 1.3, 0.7]}}


def _near_walls(**margins: float) -> dict[str, Any]:
    """Encoders may jump, so that it is the tip's place that trips."""
    return weak(max_tracking_error_mrad=500.0, max_joint_velocity_share=5.0, **margins)


SUPERVISED: Final[dict[str, Mishap]] = {
    "trip-invalid": Mishap((force("nan", 20),)),
    "trip-saturated": Mishap((force("saturate", 20, magnitude=0.1),)),
    "trip-joints-invalid": Mishap((joints("nan", 20),)),
    "trip-force-stale": Mishap((force("delay", 20, delay_ticks=9),)),
    "trip-joints-stale": Mishap((joints("delay", 8, delay_ticks=18),), weak(max_tracking_error_mrad=400.0)),
    "trip-force-repeated": Mishap((force("repeat", 20, span_ticks=1),), {"supervision": {"max_repeats": 3}}),
    "trip-joints-repeated": Mishap(
        (force("repeat", 1, span_ticks=1, duration_ticks=1), joints("repeat", 2, span_ticks=1)),
        {"supervision": {"max_repeats": 3}},
    ),
    "trip-repeated-by-turns": Mishap(
        (joints("repeat", 20, span_ticks=1, duration_ticks=1), force("repeat", 21, span_ticks=1)),
        {"supervision": {"max_repeats": 3}},
    ),
    # A tool axis that is the flange's x, on a tool that is turned upright first.
    "turned-z1": Mishap(
        (joints("offset", 0, magnitude=0.02, channels=(4,)),), {"arm": "z1", **weak(max_tracking_error_mrad=500.0)}
    ),
    "trip-frozen": Mishap((force("freeze", 20),)),
    "trip-late": Mishap((clock("overrun", 20, time_s=0.1),)),
    "trip-clock-back": Mishap((clock("clock-jump", 20, time_s=-0.5),)),
    "trip-force-untared": Mishap((force("spike", 20, magnitude=45.0, channels=(2,)),)),
    "trip-force-tared": Mishap(settings={"supervision": {"max_force_N": 4.0, "unexpected_contact_N": 2.0}}),
    # And something holds the tool from the first tick of its retraction on.
    "trip-torque": Mishap(
        (force("spike", 20, magnitude=9.0, channels=(4,)), force("offset", 21, magnitude=60.0, channels=(2,))),
        weak(retract_mm=5.0),
    ),
    "trip-torque-tared": Mishap((force("spike", 84, magnitude=9.0, channels=(3,)),), _EARLY),
    # From a sample that was measured early, so that it is close to the one before.
    "trip-force-rate": Mishap((force("spike", 84, magnitude=26.0, channels=(0,)),), _EARLY, ahead={84: -2_000_000}),
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
        (joints("spike", EXPLORING, magnitude=0.0095, channels=(0,)),), {"supervision": {"area_margin_mm": 0.05}}
    ),
    "command-not-finite": Mishap((arm("nan", 20),)),
    "trip-command-jumps": Mishap(answers={20: (4, 9.0, _POSITION)}),
    "trip-and-hold": Mishap((force("nan", 20),), {"supervision": {"on_trip": "hold"}}),
    "trip-then-stopped": Mishap(
        (force("freeze", 20),), {"supervision": {"retract_mm": 5.0, "max_equal_samples": 9}}, (36, "stop")
    ),
    "clamp-position": Mishap(
        settings=weak(max_tracking_error_mrad=500.0),
        # Beyond a limit, further, and so that the way back is faster than a joint may go, in which tick it is stopped.
        answers={2: (4, 3.15, _POSITION), 3: (4, 3.175, _POSITION), 5: (3, 0.06, _VELOCITY)},
        at=(6, "stop"),
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
    "interrupted": Mishap(settings=_EARLY, at=(84, "interrupt")),
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
    "calibrated-torque": Mishap((force("spike", EXPLORING, magnitude=9.0, channels=(3, 4, 5)),), _CALIBRATED),
    "calibrated-misfit": Mishap((force("offset", EXPLORING, magnitude=2.0, channels=(3, 4)),), _CALIBRATED),
    "calibrated-rate": Mishap((force("spike", EXPLORING, magnitude=13.0, channels=(0, 1, 2)),), _CALIBRATED),
    "calibrated-contact": Mishap((force("spike", 20, magnitude=-3.0, channels=(0, 1, 2)),), _CALIBRATED),
    "calibrated-force": Mishap((force("spike", 20, magnitude=45.0, channels=(0, 1, 2)),), _CALIBRATED),
    "trip-area-start": Mishap(
        (joints("spike", EXPLORING, magnitude=-0.0095, channels=(0,)),),
        {"supervision": {"area_margin_mm": 0.05}, "task": {"area_centre": "start"}},
        trial=2,
    ),
    "trip-area-x": Mishap(
        (joints("spike", EXPLORING, magnitude=0.06, channels=(1,)),),
        {"task": {"area_centre": "start"}, **_near_walls(depth_margin_mm=200.0, height_margin_mm=200.0)},
        trial=2,
    ),
    "lies-noisier": Mishap((force("noise", 20, magnitude=0.45),), {"supervision": {"max_noise_ratio": 2.0}}),
    "trip-kind": Mishap(tared_from=20),
    "first-kind": Mishap(tared_from=0),
    "first-joint-turned": Mishap((joints("offset", 0, magnitude=6.3, channels=(3,)),)),
    "trip-force-early": Mishap(ahead={20: 51_785_714, 30: 51_785_715}),
    "trip-workspace-x-low": Mishap(
        (joints("spike", 20, magnitude=-0.13, channels=(1,)),),
        _near_walls(side_margin_mm=1.0, height_margin_mm=300.0),
    ),
    "trip-workspace-y-low": Mishap((joints("spike", 20, magnitude=0.08, channels=(0,)),), _near_walls()),
    "answer-not-finite": Mishap(answers={20: (4, nan, _POSITION)}),
    "close-samples": Mishap(
        (
            clock("overrun", 5, time_s=0.0055, probability=0.5),
            force("spike", EXPLORING, magnitude=9.0, channels=(0,)),
        ),
    ),
    "few-tared": Mishap((force("freeze", 30, channels=(3,)),), {"task": {"tare_ticks": 4}}),
    "seven-tared": Mishap(
        (force("noise", 6, magnitude=1.0, channels=(1,)),), {"task": SOON | {"tare_ticks": 7}}, (40, "stop")
    ),
    # What has no noise by the sensor's facts is not watched for it.
    "no-torque-noise": Mishap(
        (
            force("noise", 20, magnitude=1e-3, channels=(3,), duration_ticks=30),
            force("freeze", 22, channels=(4,), duration_ticks=28),
            force("freeze", 56, channels=(1,)),
        ),
        {"cell": {"sensor": {"torque_noise_Nm": 0.0}}},
    ),
    "noiseless": Mishap(
        (
            force("freeze", 20, duration_ticks=20),
            force("repeat", 76, span_ticks=4, duration_ticks=20, honest=False),
        ),
        {"cell": {"sensor": {"torque_noise_Nm": 0.0, "force_noise_N": 0.0}}, "task": {"time_limit_s": 0.1}},
    ),
    "retract-far": Mishap((force("nan", 20),), weak(retract_mm=200.0, retract_speed_mm_s=1000.0)),
    "retract-fast": Mishap((force("nan", 20),), weak(retract_mm=20.0, retract_speed_mm_s=1000.0)),
    "noisy-at-rest": Mishap((force("noise", 6, magnitude=1.0, channels=(1,)),), {"task": SOON}),
    "fast-wrist": Mishap(
        (joints("spike", 20, magnitude=0.05443, channels=(5,)),),
        {"arm": "ur5", "task": SOON, **weak(max_tracking_error_mrad=500.0)},
        (24, "stop"),
    ),
    "wrist-back": Mishap(
        settings={"arm": "ur5", "task": SOON, **weak(max_tracking_error_mrad=500.0)},
        at=(30, "stop"),
        answers={20: (5, 0.04, _VELOCITY)},
    ),
    # A spike trips; then something seems to hold the tool that is drawn back.
    "retract-held": Mishap(
        (force("spike", 5, magnitude=60.0, channels=(2,)), force("offset", 9, magnitude=60.0, channels=(2,))),
        weak(retract_mm=5.0),
    ),
    "retract-blocked": Mishap(
        (force("nan", 5), arm("stuck", 5)),
        {"arm": "ur5", **weak(retract_mm=20.0, retract_speed_mm_s=500.0, max_tracking_error_mrad=500.0)},
        answers={4: (4, pi, _VELOCITY)},
    ),
    # Each channel drifts meanwhile, and their sum does not; one before it has a little noise, and does not count.
    "lies-recurring": Mishap(
        (
            force("repeat", 20, span_ticks=10, honest=False, duration_ticks=10),
            force("noise", 20, magnitude=1e-8, duration_ticks=10),
            force("repeat", 40, span_ticks=20, honest=False),
            force("bias-drift", 40, magnitude=0.05, channels=(0,)),
            force("bias-drift", 40, magnitude=-0.01, channels=(1, 2, 3, 4, 5)),
            force("noise", 40, magnitude=1e-9),
        ),
        {"task": {"time_limit_s": 4.0}},
    ),
    # Recordings that are too short to count, with live samples between them, one with two samples that are equal; then
    # one of two samples alone, which drift.
    "recurring-twice": Mishap(
        (
            force("freeze", 47, duration_ticks=1),
            *(
                force("repeat", tick, span_ticks=span, honest=False, duration_ticks=ticks)
                for tick, span, ticks in ((40, 20, 5), (52, 20, 7), (62, 20, 8), (72, 2, 6), (81, 2, 40))
            ),
            force("bias-drift", 72, magnitude=0.5, channels=(0,)),
        ),
        {"task": SOON},
    ),
    # A sample that comes again under its own number is no channel that stays where it is.
    "repeated-for-short": Mishap(
        (force("repeat", 20, span_ticks=1, duration_ticks=12),),
        {"task": SOON, **weak(flat_line_samples=10, max_force_age_ms=200.0)},
        (36, "stop"),
    ),
    # Two samples so close in time that their noise would be a rate; two that are half a tick apart, nearly; and one
    # that is repeated, and yet another.
    "samples-close": Mishap(
        (
            force("spike", 85, magnitude=10.0, channels=(0,), duration_ticks=1),
            force("repeat", 87, span_ticks=1, duration_ticks=2),
            force("spike", 88, magnitude=15.0, channels=(0,), duration_ticks=1),
        ),
        _EARLY,
        (92, "stop"),
        ahead={20: 7_140_000, 84: 4_100_000},
    ),
    # A tick so late that all commands are older than what they may lag by; then a stop, and a sample that is none.
    "late-and-stopped": Mishap(
        (clock("overrun", 20, time_s=0.1), force("nan", 25)),
        weak(max_gap_ms=300.0, max_joint_age_ms=300.0, max_force_age_ms=300.0),
        (24, "stop"),
    ),
    # A reading that is too old is held against commands that are newer than it.
    "trip-joints-old": Mishap(
        (joints("delay", 1, delay_ticks=12),),
        {
            "supervision": {
                "max_tracking_error_mrad": 1.0,
                "tracking_lag_ticks": 0,
                "max_joint_age_ms": 300.0,
                "max_repeats": 100,
            },
            "task": {"travel_speed_mm_s": 100.0},
        },
        trial=2,
    ),
    # A reading that is repeated is no measure of velocity, even if it is another.
    "repeated-elsewhere": Mishap(
        (
            joints("repeat", 20, span_ticks=1, duration_ticks=2),
            joints("spike", 21, magnitude=0.06, channels=(3,), duration_ticks=1),
        ),
        {"task": SOON, **weak(max_tracking_error_mrad=500.0)},
        (26, "stop"),
    ),
    # Too fast over two ticks, and not over the four that count.
    "fast-at-once": Mishap(
        (joints("spike", 2, magnitude=0.024, channels=(3,), duration_ticks=1),),
        {"task": SOON, **weak(max_tracking_error_mrad=500.0)},
        (16, "stop"),
    ),
}
