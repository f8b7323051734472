"""Fault scenarios of the golden logs: each trip reason, each outcome, and sensor faults that have a mechanism."""

from tests.golden.fault_plans import EXPLORING, SOON, arm, clock, dead, force, joints, square, weak
from tests.golden.fault_scenario import FaultScenario
from tests.golden.scenarios_supervision import COMMANDS, LIMITS, SAMPLES

_LONG = {"task": {"time_limit_s": 4.0}}


def _shallow(depth_mm, hole_mm, arm="zebra-zero", **task):
    """A short insertion."""
    peg = {"hole_depth_mm": hole_mm}
    return {"arm": arm, "task": {"time_limit_s": 4.0, "insertion_depth_mm": depth_mm} | task, "cell": {"peg": peg}}


INSERTIONS = {
    "straight-in": FaultScenario("inserted", settings=_shallow(1.0, 1.0, **SOON, surface_uncertainty_mm=0.0)),
    # Far from where the posture points: each inverse kinematics takes several steps.
    "inserted-panda": FaultScenario(
        "inserted",
        settings=_shallow(2.0, 2.0, "panda", **SOON, goal={"x_mm": 320.0, "y_mm": 420.0}, ready_height_mm=2.0),
    ),
    # The tool axis is the flange's x.
    "inserted-z1": FaultScenario(
        "inserted",
        (joints("offset", 0, magnitude=0.005, channels=(4,)),),
        {**_shallow(2.0, 2.0, "z1", **SOON), **weak(max_tracking_error_mrad=500.0)},
    ),
    # Without a floor a wall has to respond.
    "no-floor": FaultScenario("inserted", settings=_shallow(2.0, 10.0, **SOON)),
    "irregular": FaultScenario(
        "inserted",
        (
            clock("overrun", 5, time_s=0.01, probability=0.2),
            joints("duplicate", 5, probability=0.4),
            force("duplicate", 9, probability=0.2),
        ),
        {"task": {"time_limit_s": 0.8, "tare_ticks": 8}},
    ),
    "proportional": FaultScenario(
        "stopped from outside",
        settings={"control": {"force_proportional_m_per_N": 1e-5}, "task": {"time_limit_s": 3.0, "tare_ticks": 8}},
        at=(160, "stop"),
    ),
    # A force that fades for eight ticks looks like the hole.
    "false-drop": FaultScenario(
        "time limit",
        (force("offset", 140, magnitude=1.4, channels=(2,), duration_ticks=8),),
        {"task": {"time_limit_s": 0.9, "contact_kgf": 0.4}},
    ),
    # The plate is never touched, so the height of its surface is uncertain.
    "uncertain-depth": FaultScenario(
        "uncertain depth",
        settings={**_shallow(2.0, 2.0, **SOON, ready_height_mm=0.5), "control": {"damping_N_s_per_m": 4000.0}},
    ),
    "wedged": FaultScenario(
        "wedged",
        settings={
            **_shallow(10.0, 10.0, **SOON),
            "cell": {"tilt_mrad": 8.0, "peg": {"friction": 0.6, "clearance_mm": 0.02}},
        },
    ),
    "arm-stuck": FaultScenario(
        "safety trip, PLATE_NOT_FOUND",
        (arm("stuck", 60),),
        {"task": SOON, **weak(max_tracking_error_mrad=500.0)},
    ),
}
"""Insertions without a sensor fault: outcomes and arms."""

SENSOR_FAULTS = {
    "fault-dead-early": FaultScenario("safety trip, PLATE_NOT_FOUND", dead(0)),
    "fault-dead": FaultScenario("safety trip, CONTACT_MISMATCH", dead(EXPLORING), _LONG),
    "fault-dead-6dof": FaultScenario("safety trip, CONTACT_MISMATCH", dead(60), square(), policy="corner-first"),
    "fault-scaled": FaultScenario("safety trip, CONTACT_MISMATCH", (force("unit", 245, factor=0.5),), _LONG),
    "fault-inverted": FaultScenario("safety trip, PULLED", (force("unit", 120, factor=-1.0),), _LONG),
    "fault-swapped": FaultScenario("safety trip, TORQUE_WITHOUT_FORCE", (force("swap", 120, channels=(0, 2)),), _LONG),
    "fault-torque-scaled": FaultScenario(
        "safety trip, TORQUE_WITHOUT_FORCE", (force("unit", EXPLORING, factor=5.0, channels=(3, 4)),), _LONG
    ),
    "fault-noisy": FaultScenario(
        "safety trip, SENSOR_NOISE", (force("noise", 6, magnitude=1.0, channels=(1,)),), {"task": SOON}
    ),
    "fault-drifting": FaultScenario(
        "safety trip, CONTACT_MISMATCH", (force("bias-drift", EXPLORING, magnitude=-4.0, channels=(2,)),), _LONG
    ),
    # Each channel drifts meanwhile, and their sum does not.
    "fault-recurring": FaultScenario(
        "safety trip, SAMPLES_RECUR",
        (
            force("repeat", 40, span_ticks=20, honest=False),
            force("bias-drift", 40, magnitude=0.05, channels=(0,)),
            force("bias-drift", 40, magnitude=-0.01, channels=(1, 2, 3, 4, 5)),
            force("noise", 40, magnitude=1e-9),
        ),
        _LONG,
    ),
    # The time stamps do not show the backlog, which grows by 0.1 s in a second.
    "fault-lagging": FaultScenario(
        "safety trip, CONTACT_MISMATCH",
        (force("lag", 30, time_s=0.1, honest=False),),
        {"task": {"time_limit_s": 4.0, "ticks_per_action": 30}, "cell": {"hole_uncertainty_mm": 3.0}},
        trial=3,
    ),
}
"""Sensor faults that have a mechanism."""

SCENARIOS = {**SAMPLES, **LIMITS, **COMMANDS, **INSERTIONS, **SENSOR_FAULTS}
