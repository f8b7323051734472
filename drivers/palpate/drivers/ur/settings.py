"""Settings for a Universal Robots controller, and checks before and during motion."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import dist, isfinite
from typing import Final

from palpate.drivers.errors import DeviceFaultError, GarbledError, SettingError
from palpate.drivers.ur.link import CHECK, NAME, UrHello, UrState

PROTECTIVE_STOP: Final = 3
_RUNNING, _PLAYING = 7, 2
_SAFE: Final = (1, 2)
_POWER, _CLOSE = "power on and release the brakes", "close the safeguard, and reset it if it has a button"
_BUTTON, _RESTART = f"release the button, {_POWER}", "read the controller's log, and restart its safety system"
_SAFETY: Final = {
    3: ("protective stop", "clear what the arm has met, and unlock it"),
    4: ("recovery mode", "move the arm back inside its limits"),
    5: ("safeguard stop", _CLOSE),
    6: ("emergency stop of the system", _BUTTON),
    7: ("emergency stop of the robot", _BUTTON),
    8: ("violation of a safety limit", _RESTART),
    9: ("safety fault", _RESTART),
    10: ("a joint to validate", "validate it"),
    12: ("safeguard stop of the automatic mode", _CLOSE),
    13: ("three-position switch released", "hold the switch in its middle position, or select automatic mode"),
}
"""Names of modes, with advice. FACT: the names of safety_mode and robot_mode are from the RTDE guide."""
_MODES: Final = {
    -1: "no controller", 0: "disconnected", 1: "safety to confirm", 2: "booting", 3: "power off", 4: "power on",
    5: "idle, brakes on", 6: "backdrive", 8: "updating its firmware",
}  # fmt: skip
_FULL_RAD, _SLACK_RAD, _FASTEST_RAD_S = 6.6, 0.05, 7.0
"""Limits with margins: joints turn by up to 360 degrees, and wrist joints reach 360 degrees/s."""


@dataclass(frozen=True, kw_only=True)
class UrSettings:
    """Arm settings in the rig file.

    Attributes:
        lookahead_s: Look-ahead time for servoj. gain: Gain for servoj.
        silence_s: Time without data that counts as a fault.
        watchdog_s: Time without set-points after which the controller ends the program.
        force_stop_N: Change in tool force since enabling that stops the arm; 0 disables the limit.
    """

    lower_rad: tuple[float, ...]
    upper_rad: tuple[float, ...]
    velocity_rad_s: tuple[float, ...]
    period_s: float
    lookahead_s: float = 0.03
    gain: float = 1000.0
    silence_s: float = 0.1
    watchdog_s: float = 0.15
    force_stop_N: float = 0.0


def require_version(hello: UrHello, host: str) -> None:
    """Reject untested controller software versions."""
    found = re.search(r"(\d+)\.(\d+)", hello.version)
    if found is None or int(found[1]) != 5 or int(found[2]) < 9:
        problem = f"the software of its controller at {host} is {hello.version!r}, untried"
        raise SettingError(NAME, problem, "PolyScope 5.9 or a later 5 is asked for")


def require_sense(seen: UrState, before: UrState | None, host: str) -> None:
    """Reject impossible data, which a client reads after losing the start of a package."""
    # The time of a restarted controller starts at zero.
    elapsed_s = 0.0 if before is None else abs(seen.timestamp_s - before.timestamp_s)
    way_rad = 0.0 if before is None else max(abs(a - b) for a, b in zip(seen.q_rad, before.q_rad, strict=True))
    farthest_rad = max(map(abs, seen.q_rad))
    numbers = (*seen.q_rad, *seen.wrench, *seen.tcp_pose, seen.timestamp_s)
    findings = (
        (
            not all(map(isfinite, numbers)),
            "what should be numbers is none",
        ),
        (farthest_rad > _FULL_RAD, f"a joint at {farthest_rad:.3g} rad"),
        (
            way_rad > _SLACK_RAD + _FASTEST_RAD_S * elapsed_s,
            f"a joint that goes {way_rad:.3g} rad in {elapsed_s * 1e3:.0f} ms",
        ),
        (seen.robot_mode not in range(-1, 9), f"robot mode {seen.robot_mode}"),
        (seen.safety_mode not in range(1, 32), f"safety mode {seen.safety_mode}"),
        (seen.runtime not in range(6), f"runtime state {seen.runtime}"),
    )
    if wrong := [text for is_wrong, text in findings if is_wrong]:
        problem = f"what its controller at {host} sends makes no sense: {', '.join(wrong)}"
        raise GarbledError(NAME, problem, CHECK)


def require_ready(seen: UrState, host: str) -> None:
    """Raise an error that names the safety mode or the missing power."""
    if seen.safety_mode not in _SAFE:
        name, remedy = _SAFETY.get(seen.safety_mode, (f"safety mode {seen.safety_mode}", _RESTART))
    elif seen.robot_mode != _RUNNING:
        name, remedy = _MODES.get(seen.robot_mode, f"robot mode {seen.robot_mode}"), _POWER
    else:
        return
    raise DeviceFaultError(
        NAME, f"its controller at {host} reports: {name}", f"{remedy} on the pendant, then acknowledge"
    )


def require_setpoints(seen: UrState, force_N: Sequence[float] | None, force_stop_N: float, host: str) -> None:
    """Raise an error if the arm must not continue.

    Args:
        force_N: Tool force when the arm was enabled, (3,).
        force_stop_N: Change in tool force that stops the arm; 0 disables the limit.
    """
    require_ready(seen, host)
    if seen.runtime != _PLAYING:
        problem = "its control program has ended: by its watchdog, at the pendant, or by a switch to local control"
        raise DeviceFaultError(
            NAME, problem, "switch back to remote control, see the controller's log, then acknowledge"
        )
    if force_stop_N and force_N is not None and (change_N := dist(seen.wrench[:3], force_N)) > force_stop_N:
        problem = f"its tool force has changed by {change_N:.1f} N, beyond [arm] force_stop_N = {force_stop_N:g}"
        raise DeviceFaultError(NAME, problem, "see what the tool has met, then acknowledge")
