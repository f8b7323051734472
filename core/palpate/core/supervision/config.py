"""The limits of the supervisor, and which of them are weaker than they come."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Final

from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.ports import Holds, OneOf, Range, Settings, kinds_of, parts_of

_FINITE_FORCE: Final = Holds(lambda force_N: True, "a finite number of newtons: nothing runs without a force limit")


class Limit(Range):
    """The range of a limit. A larger one is always the weaker one."""

    __slots__ = ()


class Way(Range):
    """The range of what leads the tool out of trouble. A smaller one is always the weaker one."""

    __slots__ = ()


@dataclass(frozen=True)
class SupervisionConfig(Settings):
    """Limits that end a trial and stop the arm until a person acknowledges it."""

    TABLE: ClassVar[str] = "supervision"

    max_force_N: Annotated[float, _FINITE_FORCE, Limit(1.0, 1000.0, "N")] = 30.0
    """Force on the tool; before taring, its change since the trial's first sample. As it comes it is that of
    task.max_force_N: what ends a trial by its force latches. A larger one leaves the rig free after such an end."""
    max_torque_Nm: Annotated[float, Limit(0.05, 200.0, "N m")] = 5.0
    """Torque about the sensor's origin; before taring, its change since the trial's first sample."""
    max_force_rate_N_s: Annotated[float, Limit(10.0, 1e5, "N/s")] = 3000.0
    """Change of the force from one sample to the next, by the times at which they were measured."""
    unexpected_contact_N: Annotated[float, Limit(0.05, 500.0, "N")] = 3.0
    """Force while nothing may be touched; before taring, its change since such a phase began."""
    max_force_age_ms: Annotated[float, Limit(8.0, 1000.0, "ms")] = 50.0
    """Time since a force sample was measured."""
    max_joint_age_ms: Annotated[float, Limit(8.0, 1000.0, "ms")] = 100.0
    """Time since the joint angles were measured; arms on slow buses need longer than force sensors."""
    max_repeats: Annotated[int, Limit(1, 140, "ticks")] = 14
    """Control ticks in a row in which a sensor delivers nothing new."""
    max_equal_samples: Annotated[int, Limit(1, 1_000_000, "samples")] = 5
    """New force samples in a row that are equal to the one before in all six channels, as no noisy sensor's are."""
    max_recurring_samples: Annotated[int, Limit(2, 1_000_000, "samples")] = 5
    """New force samples in a row that came before in the same order, as only a recording's do."""
    flat_line_samples: Annotated[int, Limit(10, 1_000_000, "samples")] = 20
    """New force samples for which a channel may stay within a third of its own noise, as a live one's does not."""
    max_noise_ratio: Annotated[float, Limit(1.2, 1e6, "times the sensor's own")] = 1.8
    """Noise of a channel while the sensor is tared and nothing moves."""
    max_gap_ms: Annotated[float, Limit(9.0, 1000.0, "ms")] = 50.0
    """Time from one control tick to the next; the period is 7.1 ms."""
    joint_slack_mrad: Annotated[float, Limit(0.1, 100.0, "mrad")] = 5.0
    """How far a measured joint angle may be beyond the arm's limits."""
    max_joint_velocity_share: Annotated[float, Limit(0.05, 5.0, "of the arm's limits")] = 1.2
    """Measured joint velocity, as a share of the arm's limits."""
    max_tracking_error_mrad: Annotated[float, Limit(0.2, 500.0, "mrad")] = 10.0
    """Distance of a measured joint angle from what it was commanded to be."""
    tracking_lag_ticks: Annotated[int, Limit(0, 70, "ticks")] = 3
    """Control ticks that the arm may take to follow a command."""
    max_command_jump_mrad: Annotated[float, Limit(0.1, 1000.0, "mrad")] = 50.0
    """Change of a joint's command in one tick that is a fault of the task; below it commands are clamped."""
    side_margin_mm: Annotated[float, Limit(1.0, 1000.0, "mm")] = 20.0
    """How far the tip may leave the region of starts and exploration sideways, in any phase."""
    depth_margin_mm: Annotated[float, Limit(9.0, 200.0, "mm")] = 12.0
    """How far it may go beyond the insertion depth; the search for contact goes 8 mm beyond."""
    height_margin_mm: Annotated[float, Limit(1.0, 2000.0, "mm")] = 50.0
    """How far it may go above the ready height."""
    area_margin_mm: Annotated[float, Limit(0.05, 50.0, "mm")] = 1.0
    """How far it may leave the exploration area while it explores."""
    on_trip: Annotated[str, OneOf("retract", "hold")] = "retract"
    """retract: straight back along the tool axis, then stop; hold: stop where the arm is."""
    retract_mm: Annotated[float, Way(0.1, 200.0, "mm")] = 15.0
    """Length of the retraction."""
    retract_speed_mm_s: Annotated[float, Way(0.1, 1000.0, "mm/s")] = 20.0
    """Its speed."""
    weakened: tuple[str, ...] = ()
    """Names of all limits that are set weaker than their defaults, and of on_trip and retract_ likewise; each must be
    named here."""

    @override
    def check(self) -> None:
        accepted = f"less than supervision.max_force_N = {self.max_force_N:g}, or it could never trip"
        self.require("unexpected_contact_N", self.unexpected_contact_N < self.max_force_N, accepted)
        self._require_admitted()

    def _require_admitted(self) -> None:
        """Whoever weakens a limit says so by its name, and nobody gets into the habit of naming them all."""
        weaker = weaker_settings(vars(self))
        for name in weaker:
            accepted = f"{_strength(name)}, unless supervision.weakened names {name!r}"
            self.require(name, name in self.weakened, accepted)
        for name in self.weakened:
            if name not in weaker:
                accepted = "names of limits that are set weaker than their defaults"
                raise ConfigurationError(self.dotted("weakened"), name, f"{accepted}: {', '.join(weaker) or 'none is'}")


def _defaults(kind: type[Range]) -> dict[str, Any]:
    return {
        name: getattr(SupervisionConfig, name)
        for name, annotation in kinds_of(SupervisionConfig).items()
        if any(isinstance(mark, kind) for mark in parts_of(annotation)[1])
    }


_UNITS: Final = {
    name: mark.unit
    for name, annotation in kinds_of(SupervisionConfig).items()
    for mark in parts_of(annotation)[1]
    if isinstance(mark, Limit | Way)
}
DEFAULTS: Final[dict[str, Any]] = _defaults(Limit)
"""The default of every limit."""
_WAYS: Final[dict[str, Any]] = _defaults(Way)
_ON_TRIP: Final = "on_trip"


def weaker_settings(values: Mapping[str, Any]) -> tuple[str, ...]:
    """Names of the settings that are weaker than their defaults.

    Args:
        values: Settings of supervision by name, some or all; what is of another kind is left to whoever checks that.
    """
    numbers = {name: value for name, value in values.items() if isinstance(value, int | float)}
    found = [name for name, default in DEFAULTS.items() if numbers.get(name, default) > default]
    found += [name for name, default in _WAYS.items() if numbers.get(name, default) < default]
    return (*found, _ON_TRIP) if values.get(_ON_TRIP) == "hold" else tuple(found)


def _strength(name: str) -> str:
    """What a setting may be without a word."""
    default = getattr(SupervisionConfig, name)
    if name == _ON_TRIP:
        return str(default)
    return f"at {'most' if name in DEFAULTS else 'least'} {default:g} {_UNITS[name]}"


def weakened_lines(config: SupervisionConfig) -> list[str]:
    """One line for each weakened setting, to be shown whenever a run starts."""
    shown = []
    for name in weaker_settings(vars(config)):
        value, default, unit = getattr(config, name), getattr(config.__class__, name), _UNITS.get(name)
        text = f"{value} instead of {default}" if unit is None else f"{value:g} instead of {default:g} {unit}"
        shown.append(f"supervision.{name} is weakened: {text}")
    return shown
