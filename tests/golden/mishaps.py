"""Trials in which something goes wrong on purpose, for the golden logs: every kind of trip, clamp, fault and end.

A mishap is a trial of the simulated cell over ports with faults, as short as it can be: what trips does so early, and
draws the tool back by little.
"""

from __future__ import annotations

from typing import Any, Final

from tests.golden.mishap import Mishap
from tests.golden.mishap_faults import EXPLORING, SOON, arm, clock, dead, dead_across, force, joints, shove, weak
from tests.golden.mishaps_newer_tasks import NEWER_TASKS
from tests.golden.mishaps_supervision import SUPERVISED

_STRAIGHT_IN: Final[dict[str, Any]] = {
    "task": SOON | {"insertion_depth_mm": 1.0, "surface_uncertainty_mm": 0.0},
    "cell": {"peg": {"hole_depth_mm": 1.0}},
}
_NO_FLOOR: Final[dict[str, Any]] = {
    "task": _STRAIGHT_IN["task"] | {"ready_height_mm": 0.5, "time_limit_s": 4.0, "play_mm": 0.1},
    "cell": {"peg": {"hole_depth_mm": 10.0}},
}
_EDGE: Final[dict[str, Any]] = {
    "task": SOON | {"insertion_depth_mm": 2.0},
    "cell": {"peg": {"hole_depth_mm": 2.0}},
}
_SHALLOW: Final[dict[str, Any]] = {
    "task": {
        "tare_ticks": 8,
        "insertion_depth_mm": 0.5,
        "time_limit_s": 4.0,
        "surface_uncertainty_mm": 0.0,
        "depth_tolerance_mm": 0.05,
        "ready_height_mm": 0.5,
        "press_kgf": 0.14,
        "contact_kgf": 0.06,
    },
    "control": {"damping_N_s_per_m": 1000.0},
}
_PLATE: Final = {"hole_uncertainty_mm": 3.0}
"""Of the cell: in trial 3 the plate is met beside the hole."""

MISHAPS: Final[dict[str, Mishap]] = {
    **NEWER_TASKS,
    **SUPERVISED,
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
        (force("freeze", 100, channels=(2,), duration_ticks=14),),
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
            "task": {"time_limit_s": 3.0, "tare_ticks": 8},
        },
        at=(160, "stop"),
    ),
    "inserted-ur5": Mishap(
        settings={
            "arm": "ur5",
            "task": {"time_limit_s": 4.0, "insertion_depth_mm": 3.0},
            "cell": {"peg": {"hole_depth_mm": 3.0}},
        }
    ),
    "inserted-blind": Mishap(
        settings={"task": {"time_limit_s": 6.0}, "cell": {"hole_uncertainty_mm": 3.0, "hole_height_error_mm": 0.3}},
        trial=1,
    ),
    "lies-dead-approach": Mishap(dead(0)),
    "lies-dead-explore": Mishap(dead(EXPLORING), {"task": {"time_limit_s": 4.0}}),
    "lies-dead-in-the-hole": Mishap(dead(232), {"task": {"time_limit_s": 4.0}}),
    **{
        f"lies-flat-{name}": Mishap((force("freeze", 20, channels=(channel,)),))
        for name, channel in (("fx", 0), ("fy", 1), ("tx", 3), ("ty", 4))
    },
    # With noise on its torques alone.
    "lies-flat-tz": Mishap((force("freeze", 20, channels=(5,)),), {"cell": {"sensor": {"force_noise_N": 0.0}}}),
    "false-drop": Mishap(
        (force("offset", 140, magnitude=1.4, channels=(2,), duration_ticks=8),),
        {"task": {"time_limit_s": 0.9, "contact_kgf": 0.4}},
    ),
    # Encoders that say once that it is past the plate, so that it explores without having touched it first.
    "false-drop-unexplored": Mishap(
        (joints("spike", 40, magnitude=0.01, channels=(1,), duration_ticks=1),),
        {
            "task": {"tare_ticks": 8, "start_uncertainty_mm": 1.0, "ready_height_mm": 0.5},
            **weak(max_tracking_error_mrad=500.0, max_joint_velocity_share=5.0),
        },
        (146, "stop"),
    ),
    "above-plate": Mishap(
        (joints("offset", 115, magnitude=-0.003, channels=(1,)),),
        {"task": {"ticks_per_action": 8}, **weak(max_tracking_error_mrad=500.0)},
    ),
    # After the wall has answered, and before it has; and where the tool comes back to it, another force.
    "lies-dead-across": Mishap(dead_across(70), _NO_FLOOR),
    "lies-dead-at-the-wall": Mishap(dead_across(54), _NO_FLOOR),
    "lies-at-the-wall": Mishap(shove(130, 2.0, 2.5), _NO_FLOOR),
    # Encoders that do not show the tool where it was led: a rest begins when it has been waited for long enough.
    "never-arrived": Mishap((joints("offset", 60, magnitude=2e-4, channels=(0,)),), _NO_FLOOR, (140, "stop")),
    "no-floor": Mishap(
        settings={
            "task": {"start_uncertainty_mm": 0.0, "insertion_depth_mm": 2.0},
            "cell": {"peg": {"hole_depth_mm": 10.0}},
        },
    ),
    "sinks-on-late": Mishap(
        # At both walls the force comes back a little otherwise, as where friction keeps some; and as the proof begins
        # one comes from aside.
        (
            clock("overrun", 142, time_s=0.02),
            *shove(250, -0.3, 0.3),
            force("offset", 143, magnitude=3.0, channels=(1,), duration_ticks=1),
        ),
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
            "recurring-late": force("repeat", 66, span_ticks=62, honest=False),
            "noisy": force("noise", 20, magnitude=1.0),
            "swapped": force("swap", 20, channels=(0, 2)),
            "torque-scaled": force("unit", EXPLORING, factor=5.0, channels=(3, 4)),
            "pulled": force("offset", EXPLORING, magnitude=12.0, channels=(2,)),
            "drifting": force("bias-drift", EXPLORING, magnitude=4.0, channels=(2,)),
            "dead": force("unit", 120, factor=0.0001),
        }.items()
    },
    "straight-in": Mishap(settings=_STRAIGHT_IN),
    # A force that nothing gives leads it out again on its way down.
    "led-out-sinking": Mishap(
        (force("offset", 75, magnitude=-14.0, channels=(2,)),),
        {"task": {"start_uncertainty_mm": 0.0, "tare_ticks": 7, "ready_height_mm": 1.0}},
    ),
    # From the first sample after the tare on.
    "pulled-at-once": Mishap((force("offset", 18, magnitude=3.0, channels=(2,)),), {"task": SOON}),
    # In the air a wall pulls no tool that is pushed aside.
    "pulled-aside": Mishap((*shove(40, 4.0, 0.1), force("offset", 40, magnitude=3.5, channels=(2,))), {"task": SOON}),
    # A force that comes two ticks late comes one tick late; and one that nothing but an edge gives.
    "late-force-sooner": Mishap(
        (
            force("delay", 3, delay_ticks=2, duration_ticks=147),
            force("delay", 150, delay_ticks=1),
            *shove(166, 6.0, 6.0, duration_ticks=8),
        ),
        {
            "arm": "ur5",
            "task": {"time_limit_s": 3.0, "insertion_depth_mm": 2.0, "tare_ticks": 7, "ready_height_mm": 1.0},
            "cell": {"peg": {"hole_depth_mm": 2.0}},
        },
        (190, "stop"),
        policy="random",
        trial=3,
    ),
    # What was recorded happens to follow an uneven heave, and comes again.
    "lies-coming-again": Mishap(
        (
            force("repeat", 120, span_ticks=21, honest=False),
            force("noise", 120, magnitude=0.1, channels=(0, 1, 2)),
            force("noise", 120, magnitude=0.004, channels=(3, 4, 5)),
        ),
        {
            "arm": "ur5",
            "task": {"tare_ticks": 7, "ready_height_mm": 0.5, "time_limit_s": 2.0, "ticks_per_action": 30},
            "cell": _PLATE,
        },
        policy="random",
        trial=4,
    ),
    # Noise that shows the force at another lag in the second look than in the first.
    "late-force-noisy": Mishap(
        (force("delay", 3, delay_ticks=2), force("noise", 30, magnitude=0.15, channels=(0, 1, 2))),
        {"arm": "ur5", "task": {"time_limit_s": 3.0, "tare_ticks": 7, "ready_height_mm": 1.0}},
        (128, "stop"),
        policy="random",
        trial=5,
    ),
    "unproved": Mishap(
        settings={
            "task": {
                "tare_ticks": 8,
                "insertion_depth_mm": 1.0,
                "start_uncertainty_mm": 2.5,
                "ready_height_mm": 1.0,
            },
            "cell": {"peg": {"hole_depth_mm": 1.0}},
        }
    ),
    "inserted-late": Mishap(
        (clock("overrun", 72, time_s=0.1),), {**_STRAIGHT_IN, "task": SOON | {"insertion_depth_mm": 1.0}}
    ),
    "edge": Mishap((force("offset", 55, magnitude=-2.5, channels=(2,), duration_ticks=6),), _EDGE),
    "edge-high": Mishap(
        (force("offset", 38, magnitude=-2.5, channels=(2,), duration_ticks=6),),
        {**_EDGE, "cell": _EDGE["cell"] | {"hole_height_error_mm": 1.0}},
    ),
    "no-contact": Mishap(
        (force("unit", 0, factor=0.01),),
        {"task": {"insertion_depth_mm": 0.5}, **weak(flat_line_samples=1_000_000)},
    ),
    "leaning": Mishap(settings={"cell": {"tilt_mrad": 2.0, "tilt_heading_deg": 40.0}}),
    "lift-low": Mishap(
        (
            joints("offset", 0, magnitude=0.006, channels=(1,)),
            # What was borne while the tool was lifted out is no contact afterwards.
            force("offset", 0, magnitude=4.0, channels=(0,), duration_ticks=2),
        ),
        {"task": SOON},
        (26, "stop"),
    ),
    "placed": Mishap(settings={"task": SOON}, at=(20, "stop"), placed=True),
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
    "no-depth": Mishap((force("offset", 190, magnitude=-1.5, channels=(2,)),), _SHALLOW),
    "lies-dead-across-soon": Mishap(
        dead_across(128),
        {"task": {"tare_ticks": 8, "time_limit_s": 4.0, "play_mm": 0.01}},
    ),
    **{
        f"freed-{name}": Mishap(
            tuple(force("offset", tick, magnitude=-1.4, channels=(2,), **more) for tick, more in offsets),
            {"task": SOON | {"time_limit_s": 4.0}},
            (100, "stop"),
        )
        for name, offsets in {
            "by-three": ((74, {}),),
            "by-two": ((73, {}),),
            "by-three-later": ((73, {"duration_ticks": 1}), (77, {})),
        }.items()
    },
    "too-slow": Mishap(
        settings={
            "task": SOON | {"insertion_depth_mm": 30.0, "ready_height_mm": 0.5},
            "cell": {"peg": {"hole_depth_mm": 40.0}, "sensor": {"torque_noise_Nm": 0.0, "force_noise_N": 0.0}},
            "control": {"damping_N_s_per_m": 4000.0},
        }
    ),
    "inserted-panda": Mishap(
        settings={
            "arm": "panda",
            # Far from where the arm's posture points: each step goes there as far as it may.
            "task": SOON | {"goal": {"x_mm": 320.0, "y_mm": 420.0}, "insertion_depth_mm": 2.0, "ready_height_mm": 2.0},
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
    # So much too soft that it is looked at a little longer, and then is stiff enough.
    "touched-softly": Mishap(
        (force("unit", 30, factor=0.8, channels=(2,)), force("offset", 30, magnitude=1.04, channels=(2,))),
        {"task": {"tare_ticks": 8, "ready_height_mm": 0.5, "ticks_per_action": 12}, "cell": _PLATE},
        (80, "stop"),
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
    "heavy-tool": Mishap((force("offset", 0, magnitude=30.0, channels=(2,)),), {"task": SOON}, (4, "stop")),
    # A lateral force that seems to come from the tip leads the tool as far aside as a wall can be, and half back.
    "shoved": Mishap(
        (*shove(90, 8.0, 16.0), *shove(122, 0.5, -12.0)), {"task": SOON | {"play_mm": 0.1}}, (130, "stop")
    ),
    # Borne by less than a peg rests with, which shows when the tool is held.
    "freed-at-rest": Mishap(
        (force("offset", 72, magnitude=-1.5, channels=(2,)),),
        {"task": SOON | {"contact_kgf": 0.1, "insertion_depth_mm": 4.0}, "cell": {"peg": {"hole_depth_mm": 4.0}}},
    ),
}
