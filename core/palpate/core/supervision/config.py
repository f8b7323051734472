"""The supervisor's limits, and the check for weakened limits."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Final

from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.ports import Holds, OneOf, Range, Settings, kinds_of, parts_of

_FINITE_FORCE: Final = Holds(lambda force_N: True, "a finite number of newtons: nothing runs without a force limit")


class Limit(Range):
    """Range for a limit; a larger value weakens the limit."""

    __slots__ = ()


class Motion(Range):
    """Range for a retraction parameter; a smaller value weakens the retraction."""

    __slots__ = ()


@dataclass(frozen=True)
class SupervisionConfig(Settings):
    """Limits that end a trial and stop the arm until a person acknowledges it."""

    TABLE: ClassVar[str] = "supervision"

    max_force_N: Annotated[float, _FINITE_FORCE, Limit(1.0, 1000.0, "N")] = 30.0
    """Force on the tool; before taring, its change since the trial's first sample. By default it equals
    task.max_force_N, so that a trial ended by its force limit latches. With a larger value, such an end does not latch
    the rig."""
    max_torque_Nm: Annotated[float, Limit(0.05, 200.0, "N m")] = 5.0
    """Torque about the sensor's origin; before taring, its change since the trial's first sample."""
    max_force_rate_N_s: Annotated[float, Limit(10.0, 1e5, "N/s")] = 3000.0
    """Change in force between two samples, divided by the difference between their source times."""
    unexpected_contact_N: Annotated[float, Limit(0.05, 500.0, "N")] = 3.0
    """Force in phases without permitted contact; before taring, its change since the phase began."""
    max_force_age_ms: Annotated[float, Limit(8.0, 1000.0, "ms")] = 50.0
    """Age of a force sample."""
    max_joint_age_ms: Annotated[float, Limit(8.0, 1000.0, "ms")] = 100.0
    """Age of a joint sample; arms on slow buses need more than force sensors."""
    max_repeats: Annotated[int, Limit(1, 140, "ticks")] = 14
    """Consecutive control ticks without a new sample."""
    max_equal_samples: Annotated[int, Limit(1, 1_000_000, "samples")] = 5
    """Consecutive new force samples that are equal in all six channels; a live sensor has noise that prevents this."""
    max_recurring_samples: Annotated[int, Limit(2, 1_000_000, "samples")] = 5
    """Consecutive new force samples that repeat earlier ones in order, as in a replayed recording."""
    flat_line_samples: Annotated[int, Limit(10, 1_000_000, "samples")] = 20
    """Consecutive new force samples in which a channel stays within a third of its noise, as if dead."""
    max_noise_ratio: Annotated[float, Limit(1.2, 1e6, "times the sensor's own")] = 1.8
    """Channel noise during taring, while nothing moves."""
    max_gap_ms: Annotated[float, Limit(9.0, 1000.0, "ms")] = 50.0
    """Time from one control tick to the next; the period is 7.1 ms."""
    joint_slack_mrad: Annotated[float, Limit(0.1, 100.0, "mrad")] = 5.0
    """Distance by which a measured joint angle exceeds the arm's limits."""
    max_joint_velocity_share: Annotated[float, Limit(0.05, 5.0, "of the arm's limits")] = 1.2
    """Measured joint velocity, as a fraction of the arm's limits."""
    max_tracking_error_mrad: Annotated[float, Limit(0.2, 500.0, "mrad")] = 10.0
    """Difference between a measured joint angle and its command."""
    tracking_lag_ticks: Annotated[int, Limit(0, 70, "ticks")] = 3
    """Control ticks that the arm may take to follow a command."""
    max_command_jump_mrad: Annotated[float, Limit(0.1, 1000.0, "mrad")] = 50.0
    """Change in a joint command in one tick that counts as a task fault; smaller changes are clamped."""
    side_margin_mm: Annotated[float, Limit(1.0, 1000.0, "mm")] = 20.0
    """Lateral distance from the tip to the region of starts and exploration, in any phase."""
    depth_margin_mm: Annotated[float, Limit(9.0, 200.0, "mm")] = 12.0
    """Tip distance below the insertion depth; the contact search goes 8 mm beyond it."""
    height_margin_mm: Annotated[float, Limit(1.0, 2000.0, "mm")] = 50.0
    """Tip distance above the ready height."""
    area_margin_mm: Annotated[float, Limit(0.05, 50.0, "mm")] = 1.0
    """Distance from the tip to the exploration area during exploration."""
    on_trip: Annotated[str, OneOf("retract", "hold")] = "retract"
    """retract: straight back along the tool axis, then stop; hold: stop in place."""
    retract_mm: Annotated[float, Motion(0.1, 200.0, "mm")] = 15.0
    """Retraction length."""
    retract_speed_mm_s: Annotated[float, Motion(0.1, 1000.0, "mm/s")] = 20.0
    """Retraction speed."""
    weakened: tuple[str, ...] = ()
    """Names of all limits weaker than their defaults, including on_trip and retract_; each must be listed here."""

    @override
    def check(self) -> None:
        accepted = f"less than supervision.max_force_N = {self.max_force_N:g}, or it can never trip"
        self.require("unexpected_contact_N", self.unexpected_contact_N < self.max_force_N, accepted)
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
    if isinstance(mark, Limit | Motion)
}
DEFAULTS: Final[dict[str, Any]] = _defaults(Limit)
"""The default for every limit."""
_MOTIONS: Final[dict[str, Any]] = _defaults(Motion)
_ON_TRIP: Final = "on_trip"


def weaker_settings(values: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of the settings weaker than their defaults.

    Args:
        values: Some or all supervision settings by name; values of other types are checked elsewhere.
    """
    numbers = {name: value for name, value in values.items() if isinstance(value, int | float)}
    found = [name for name, default in DEFAULTS.items() if numbers.get(name, default) > default]
    found += [name for name, default in _MOTIONS.items() if numbers.get(name, default) < default]
    return (*found, _ON_TRIP) if values.get(_ON_TRIP) == "hold" else tuple(found)


def _strength(name: str) -> str:
    """Return the bound on a setting beyond which it needs an entry in ``weakened``."""
    default = getattr(SupervisionConfig, name)
    if name == _ON_TRIP:
        return str(default)
    return f"at {'most' if name in DEFAULTS else 'least'} {default:g} {_UNITS[name]}"


def weakened_lines(config: SupervisionConfig) -> list[str]:
    """Return one line per weakened setting, to be printed at the start of every run."""
    shown = []
    for name in weaker_settings(vars(config)):
        value, default, unit = getattr(config, name), getattr(config.__class__, name), _UNITS.get(name)
        text = f"{value} instead of {default}" if unit is None else f"{value:g} instead of {default:g} {unit}"
        shown.append(f"supervision.{name} is weakened: {text}")
    return shown
