"""Settings for the Zebra Zero arm."""

import enum
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from palpate.drivers import nmc
from palpate.drivers.errors import SettingError
from palpate.drivers.zebra_zero.codec import DEVICE, JOINTS, Six, Transmission


@dataclass(frozen=True)
class JointLimits:
    """Limits for the six joints.

    Attributes:
        lower_rad: Lower limits, (6,). FACT: the port. Evidence: medium for joints 1 to 3, weak for the wrist (a note in
            the client says that its limits are still to be fixed).
        upper_rad: Upper limits, (6,), from the same source.
        velocity_rad_per_s: Maximum joint velocity. FACT: a software cap in the port; the arm's own is NOT FOUND.
        acceleration_rad_per_s2: Maximum joint acceleration, enforced by firmware with trapezoids. CALC from the port's
            servo default of 10 000 on joints 1 to 3. (One port configuration has 0.2, a different software cap.)
    """

    lower_rad: Six = (-3.14, -1.07, -1.70, -3.14, -3.14, -3.14)
    upper_rad: Six = (3.14, 1.70, 1.07, 3.14, 3.14, 3.14)
    velocity_rad_per_s: float = 1.0
    acceleration_rad_per_s2: float = 19.0

    def outside(self, position_rad: Sequence[float], tolerance_rad: float = 0.0) -> int | None:
        """Return the index of the first joint beyond a limit by more than the tolerance, or None if there is none."""
        for joint, angle in enumerate(position_rad):
            # Written so that an angle that is not a number is also outside.
            if not self.lower_rad[joint] - tolerance_rad <= angle <= self.upper_rad[joint] + tolerance_rad:
                return joint
        return None


REPLY_ITEMS: Final = nmc.StatusItem.POSITION | nmc.StatusItem.AUX
"""Items in every reply in a cycle. AUX adds one byte per axis and immediately shows whether a servo is off."""
FIRMWARE_WITH_MOVING_TARGETS: Final = 10
"""Firmware of the PIC-SERVO SC that accepts a new trapezoid while one is running. FACT: data sheet."""


class Streaming(enum.Enum):
    """Method for sending set-points to a motor, determined by the modules' firmware.

    ``TRAPEZOID`` loads a new target while the motor is still approaching the last one, so the firmware's own limits on
    velocity and acceleration stay in force. FACT: firmware 10 of the SC allows it; on a Logosol LS-173AP a new position
    during a motion is taken as an offset, and the arm moves to the wrong place. ``STOP_HERE`` sets the servo's position
    without a profile (FACT: Logosol, libnmc), which works on both but leaves only this driver's limits in force.
    """

    TRAPEZOID = "trapezoid"
    STOP_HERE = "stop here"


RESERVE: Final = 0.1
"""Fraction of the period that the bus must leave free."""
LIMIT_TOLERANCE_RAD: Final = 0.02
"""Distance beyond the limits at which a measured pose counts as a fault."""
STORED_TOLERANCE_COUNTS: Final = 200
"""Maximum difference from the stored counters for which the stored position is still used."""
PROFILE_MARGIN: Final = 1.25
"""Ratio of the firmware's own velocity and acceleration limits to those of the joints, so that a profile can catch up
with its set-points."""
STOP_TIMEOUT_S: Final = 1.0
"""Time within which a stop must be complete. CALC: braking from the maximum velocity takes 53 ms."""


ERROR_LIMIT_COUNTS: Final = 4000
"""Position error at which the firmware switches a servo off."""
GAINS: Final = nmc.set_gain(100, 1000, 0, 0, 255, 0, ERROR_LIMIT_COUNTS, 1, 0)
"""Servo filter: kp 100, kd 1000, output up to 255. FACT: the port sends these defaults to the real arm."""


@dataclass(frozen=True, kw_only=True)
class ZebraZeroSettings:
    """Settings for the Zebra Zero arm. Values without a mark are this driver's choices.

    Attributes:
        divider: Number of control ticks per ``cycle``; rejected if the bus cannot carry the rate.
        require_power: True to treat a missing motor supply as a fault. INFERENCE: some amplifiers may not report it.
        use_limit_inputs: True to treat an active limit input as a fault. NOT FOUND: whether the arm has limit switches.

    Raises:
        SettingError: The bus cannot carry the rate.
    """

    control_rate_Hz: float
    bus: nmc.BusSettings = field(default_factory=nmc.BusSettings)
    transmission: Transmission = field(default_factory=Transmission)
    limits: JointLimits = field(default_factory=JointLimits)
    divider: int = 3
    require_power: bool = True
    use_limit_inputs: bool = True

    def __post_init__(self) -> None:
        if self.rate_Hz > self.highest_rate_Hz:
            problem = f"{self.rate_Hz:.4g} Hz does not fit the bus, which carries {self.highest_rate_Hz:.4g} Hz"
            raise SettingError(DEVICE, problem, "choose a larger divider, a higher baud rate or a lower latency timer")

    @property
    def rate_Hz(self) -> float:
        """Rate at which ``cycle`` is called."""
        return self.control_rate_Hz / self.divider

    @property
    def highest_rate_Hz(self) -> float:
        """Maximum rate that leaves the reserve (CALC); both streaming methods take the same time."""
        line = nmc.SerialTiming(self.bus.baud, self.bus.adapter_latency_s)
        setpoint = nmc.stop_motor(nmc.StopControl.AMP_ENABLE | nmc.StopControl.HERE, 0)
        exchange_s = line.exchange_s(setpoint.size_bytes + nmc.reply_size_bytes(REPLY_ITEMS))
        return (1.0 - RESERVE) / (JOINTS * exchange_s)
