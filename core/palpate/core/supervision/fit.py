"""Check the limits against the task, arm and sensor, and reject a limit that always or never trips."""

from math import inf
from typing import Final

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.core.motion import Array, Kinematics
from palpate.core.ports import CONTROL_RATE_HZ, SENSOR_FRAME, SensorFacts
from palpate.core.supervision.config import SupervisionConfig
from palpate.core.supervision.retreat import Retreat
from palpate.core.trial import N_PER_KGF, TaskConfig

_NOISE: Final = 9.0
"""Bound on the difference between two samples of three channels, in standard deviations of one channel."""
_PERIOD_S: Final = 1.0 / CONTROL_RATE_HZ
WITHDRAWAL_SHARE: Final = 2.0
"""Factor that raises the force limit while a tool is withdrawn from a hole, which releases elastic force."""


def require_fitting(
    config: SupervisionConfig, task: TaskConfig, kinematics: Kinematics, ready_rad: Array, sensor: SensorFacts
) -> None:
    """Check the limits against the arm, task and sensor.

    Args:
        kinematics: The arm's kinematics; their state is changed.
        ready_rad: Pose above the goal, (n,), from which the retraction is computed.

    Raises:
        ConfigurationError: A limit always or never trips, the arm cannot perform the retraction, or the sensor's frame
            differs from the task's.
    """
    least_Hz = least_rate_Hz(config)
    if sensor.rate_Hz <= least_Hz:
        accepted = f"above {least_Hz:.4g}, or its samples are too old; set the sensor to send more often"
        raise ConfigurationError("force_sensor.facts.rate_Hz", sensor.rate_Hz, accepted)
    if sensor.frame != SENSOR_FRAME:
        accepted = f"{SENSOR_FRAME}: the task works with wrenches in that frame"
        raise ConfigurationError("force_sensor.facts.frame", sensor.frame, accepted)
    press_N = task.press_kgf * N_PER_KGF
    noise_N, noise_Nm = _NOISE * sensor.noise_N, _NOISE * sensor.noise_Nm
    # Along its weakest axis, a sensor cannot measure more than the range of that axis.
    range_N, range_Nm = min(sensor.range_N), min(sensor.range_Nm)
    _between(config, "max_force_N", press_N, "the pressing force", range_N)
    _between(config, "max_force_N", noise_N, "what noise alone shows", range_N)
    _between(config, "unexpected_contact_N", noise_N, "what noise alone shows", range_N)
    # A range specified in the rig file bounds the derived limit.
    stated = ", as [force_sensor.facts] range_Nm in the rig file would make it"
    _between(config, "max_torque_Nm", noise_Nm, "what noise alone shows", range_Nm, stated)
    rate, most = noise_N / _PERIOD_S, 2.0 * range_N / _PERIOD_S
    _between(config, "max_force_rate_N_s", rate, "what noise alone shows", most)
    _between(config, "max_tracking_error_mrad", 1e4 * max(kinematics.arm.encoder_step_rad), "ten encoder steps", inf)
    reach_mrad = float(kinematics.velocity_limit_rad_s.max()) * _PERIOD_S * 1e3
    _between(
        config,
        "max_command_jump_mrad",
        reach_mrad,
        "what the joints' velocity limits allow ([arm] velocity_limit_rad_s)",
        inf,
    )
    if config.on_trip == "retract":
        _require_retraction(config, kinematics, ready_rad)


def least_rate_Hz(config: SupervisionConfig) -> float:
    """Return the sample rate below which a force sensor trips the supervisor before its next sample arrives."""
    return max(1e3 / config.max_force_age_ms, CONTROL_RATE_HZ / (config.max_repeats + 1))


def _between(config: SupervisionConfig, name: str, low: float, what: str, high: float, how: str = "") -> None:
    value = getattr(config, name)
    config.require(name, value > low, f"above {low:.4g}, {what}, or every trial trips")
    config.require(name, value < high, f"below {high:.4g}, the sensor's range, or it can never trip{how}")


def _require_retraction(config: SupervisionConfig, kinematics: Kinematics, ready_rad: Array) -> None:
    back = np.array([0.0, 0.0, -config.retract_speed_mm_s * 1e-3, 0.0, 0.0, 0.0])
    joint_speeds = np.linalg.lstsq(kinematics.tip_jacobian(ready_rad), back, rcond=None)[0]
    share = float((np.abs(joint_speeds) / kinematics.velocity_limit_rad_s).max())
    speed, arm = config.retract_speed_mm_s, kinematics.arm.name
    accepted = f"at most {speed / max(share, 1.0):.4g} mm/s, where a joint of {arm} is at its velocity limit"
    config.require("retract_speed_mm_s", share <= 1.0, accepted)
    retreat = Retreat(kinematics, config.retract_mm * 1e-3, speed * 1e-3, _PERIOD_S)
    held = tuple(ready_rad.tolist())
    retreat.start(held)
    while not retreat.finished:
        held = retreat.step(held)
    way_mm = retreat.travelled_m * 1e3
    accepted = f"at most {way_mm:.4g} mm, the travel of {kinematics.arm.name} above its ready pose"
    config.require("retract_mm", way_mm >= 0.99 * config.retract_mm, accepted)


def limits_line(supervision: SupervisionConfig, task: TaskConfig) -> str:
    """Return the force limits in the order in which they stop the arm, to be printed at the start of a run on a rig."""
    limits = [
        (supervision.unexpected_contact_N, "supervision.unexpected_contact_N"),
        (task.max_force_N, "task.max_force_N"),
        (supervision.max_force_N, "supervision.max_force_N"),
        (WITHDRAWAL_SHARE * task.max_force_N, f"{WITHDRAWAL_SHARE:g} x task.max_force_N"),
    ]
    # The sort is stable: of two equal limits the task's own is checked first.
    limits.sort(key=lambda limit: limit[0])
    return "force limits: " + ", ".join(f"{limit_N:g} N ({setting})" for limit_N, setting in limits)
