"""The limits of the supervisor, and which of them are weaker than they come."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import isfinite
from typing import Final, NamedTuple

from palpate.core.errors import ConfigurationError, require_in, require_one_of, require_whole

_PREFIX: Final = "supervision."


class _Limit(NamedTuple):
    """What a limit may be set to. A larger one is always the weaker one."""

    low: float
    high: float
    unit: str


_LIMITS: Final[dict[str, _Limit]] = {
    "max_force_N": _Limit(1.0, 1000.0, "N"),
    "max_torque_Nm": _Limit(0.05, 200.0, "N m"),
    "max_force_rate_N_s": _Limit(10.0, 1e5, "N/s"),
    "unexpected_contact_N": _Limit(0.05, 500.0, "N"),
    "max_force_age_ms": _Limit(8.0, 1000.0, "ms"),
    "max_joint_age_ms": _Limit(8.0, 1000.0, "ms"),
    "max_repeats": _Limit(1, 140, "ticks"),
    "max_equal_samples": _Limit(1, 1_000_000, "samples"),
    "max_gap_ms": _Limit(9.0, 1000.0, "ms"),
    "joint_slack_mrad": _Limit(0.1, 100.0, "mrad"),
    "max_joint_velocity_share": _Limit(0.05, 5.0, "of the arm's limits"),
    "max_tracking_error_mrad": _Limit(0.2, 500.0, "mrad"),
    "tracking_lag_ticks": _Limit(0, 70, "ticks"),
    "max_command_jump_mrad": _Limit(0.1, 1000.0, "mrad"),
    "side_margin_mm": _Limit(1.0, 1000.0, "mm"),
    "depth_margin_mm": _Limit(9.0, 200.0, "mm"),
    "height_margin_mm": _Limit(1.0, 2000.0, "mm"),
    "area_margin_mm": _Limit(0.05, 50.0, "mm"),
}


@dataclass(frozen=True)
class SupervisionConfig:
    """Limits that end a trial and stop the arm until a person acknowledges it."""

    max_force_N: float = 40.0
    """Force on the tool; before taring, its change since the trial's first sample."""
    max_torque_Nm: float = 6.0
    """Torque about the sensor's origin; before taring, its change since the trial's first sample."""
    max_force_rate_N_s: float = 3000.0
    """Change of the force from one sample to the next, by the times at which they were measured."""
    unexpected_contact_N: float = 3.0
    """Force while nothing may be touched; before taring, its change since such a phase began."""
    max_force_age_ms: float = 50.0
    """Time since a force sample was measured."""
    max_joint_age_ms: float = 100.0
    """Time since the joint angles were measured; arms on slow buses need longer than force sensors."""
    max_repeats: int = 14
    """Control ticks in a row in which a sensor delivers nothing new."""
    max_equal_samples: int = 5
    """New force samples in a row that are equal to the one before in all six channels, as no noisy sensor's are."""
    max_gap_ms: float = 50.0
    """Time from one control tick to the next; the period is 7.1 ms."""
    joint_slack_mrad: float = 5.0
    """How far a measured joint angle may be beyond the arm's limits."""
    max_joint_velocity_share: float = 1.2
    """Measured joint velocity, as a share of the arm's limits."""
    max_tracking_error_mrad: float = 10.0
    """Distance of a measured joint angle from what it was commanded to be."""
    tracking_lag_ticks: int = 3
    """Control ticks that the arm may take to follow a command."""
    max_command_jump_mrad: float = 50.0
    """Change of a joint's command in one tick that is a fault of the task; below it commands are clamped."""
    side_margin_mm: float = 20.0
    """How far the tip may leave the region of starts and exploration sideways, in any phase."""
    depth_margin_mm: float = 12.0
    """How far it may go beyond the insertion depth; the search for contact goes 8 mm beyond."""
    height_margin_mm: float = 50.0
    """How far it may go above the ready height."""
    area_margin_mm: float = 1.0
    """How far it may leave the exploration area while it explores."""
    on_trip: str = "retract"
    """retract: straight back along the tool axis, then stop; hold: stop where the arm is."""
    retract_mm: float = 15.0
    """Length of the retraction."""
    retract_speed_mm_s: float = 20.0
    """Its speed."""
    weakened: tuple[str, ...] = ()
    """Names of all limits that are set weaker than their defaults; each must be named here."""

    def __post_init__(self) -> None:
        if not isinstance(self.max_force_N, (int, float)) or not isfinite(self.max_force_N):
            accepted = "a finite number of newtons: nothing runs without a force limit"
            raise ConfigurationError(_PREFIX + "max_force_N", self.max_force_N, accepted)
        for name, limit in _LIMITS.items():
            value = getattr(self, name)
            if isinstance(limit.low, int):
                require_whole(_PREFIX + name, value, limit.low, int(limit.high))
            else:
                require_in(_PREFIX + name, value, limit.low, limit.high)
        require_one_of(_PREFIX + "on_trip", self.on_trip, ("retract", "hold"))
        require_in(_PREFIX + "retract_mm", self.retract_mm, 0.1, 200.0)
        require_in(_PREFIX + "retract_speed_mm_s", self.retract_speed_mm_s, 0.1, 1000.0)
        if self.unexpected_contact_N >= self.max_force_N:
            accepted = f"less than supervision.max_force_N = {self.max_force_N:g}, or it could never trip"
            raise ConfigurationError(_PREFIX + "unexpected_contact_N", self.unexpected_contact_N, accepted)
        self._require_admitted()

    def _require_admitted(self) -> None:
        """Whoever weakens a limit says so by its name, and nobody gets into the habit of naming them all."""
        weaker = weaker_limits(self)
        for name in weaker:
            if name not in self.weakened:
                accepted = (
                    f"at most {DEFAULTS[name]:g} {_LIMITS[name].unit}, unless supervision.weakened names {name!r}"
                )
                raise ConfigurationError(_PREFIX + name, getattr(self, name), accepted)
        for name in self.weakened:
            if name not in weaker:
                accepted = "names of limits that are set weaker than their defaults"
                raise ConfigurationError(_PREFIX + "weakened", name, f"{accepted}: {', '.join(weaker) or 'none is'}")


DEFAULTS: Final[dict[str, float]] = {
    field.name: field.default
    for field in fields(SupervisionConfig)
    if field.name in _LIMITS and isinstance(field.default, (int, float))
}
"""The default of every limit."""


def weaker_limits(config: SupervisionConfig) -> tuple[str, ...]:
    """Names of the limits that are set weaker than their defaults."""
    return tuple(name for name, default in DEFAULTS.items() if getattr(config, name) > default)


def weakened_lines(config: SupervisionConfig) -> list[str]:
    """One line for each weakened limit, to be shown whenever a run starts."""
    return [
        f"supervision.{name} is weakened: {getattr(config, name):g} instead of {DEFAULTS[name]:g} {_LIMITS[name].unit}"
        for name in weaker_limits(config)
    ]
