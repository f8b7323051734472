"""What shall go wrong, where and when: one fault, checked before anything runs."""

from dataclasses import dataclass, fields
from typing import Annotated, Final

from typing_extensions import override

from palpate.core.errors import ConfigurationError, require_whole
from palpate.core.ports import OneOf, Range, Settings

_SENSORS: Final = ("force_sensor", "joint_encoder")
PORTS: Final = (*_SENSORS, "arm", "clock")
"""The ports, by the names of their fields in ``palpate.core.control_loop.Ports``."""

WRENCH_CHANNELS: Final = 6
_MOST_CHANNELS: Final = 64
_GREAT: Final = 1e9
_PAIR: Final = 2


@dataclass(frozen=True, slots=True)
class KindOfFault:
    """What a plan of one kind may hold.

    Attributes:
        settings: Fields of a plan that mean something to it, besides kind, port, time and seed.
    """

    ports: tuple[str, ...]
    settings: tuple[str, ...]
    text: str


KINDS: Final[dict[str, KindOfFault]] = {
    "drop": KindOfFault((*_SENSORS, "arm"), ("probability",), "lost on its way"),
    "delay": KindOfFault((*_SENSORS, "arm"), ("delay_ticks", "honest"), "{p.delay_ticks} ticks late"),
    "duplicate": KindOfFault(_SENSORS, ("probability",), "the sample before once more"),
    "freeze": KindOfFault(_SENSORS, ("channels",), "values stand still while number and time go on"),
    "repeat": KindOfFault(_SENSORS, ("span_ticks", "honest"), "the last {p.span_ticks} samples again"),
    "bias-drift": KindOfFault(_SENSORS, ("magnitude", "channels"), "drifting by {p.magnitude:g} a second"),
    "noise": KindOfFault(_SENSORS, ("magnitude", "channels"), "noise of {p.magnitude:g} on top"),
    "offset": KindOfFault(_SENSORS, ("magnitude", "channels"), "off by {p.magnitude:g}"),
    "swap": KindOfFault(_SENSORS, ("channels",), "channels {p.channels} exchanged"),
    "lag": KindOfFault(_SENSORS, ("time_s", "honest"), "later by {p.time_s:g} s more each second"),
    "spike": KindOfFault(_SENSORS, ("magnitude", "probability", "channels"), "a spike of {p.magnitude:g}"),
    "nan": KindOfFault((*_SENSORS, "arm"), ("probability", "channels"), "not a number"),
    "saturate": KindOfFault(("force_sensor",), ("magnitude", "channels", "honest"), "at its limit of {p.magnitude:g}"),
    "unit": KindOfFault((*_SENSORS, "arm"), ("factor", "channels"), "in another unit: times {p.factor:g}"),
    "disconnect": KindOfFault((*_SENSORS, "arm"), (), "does not answer any more"),
    "stuck": KindOfFault(("arm",), (), "commands are acknowledged and nothing moves"),
    "clock-jump": KindOfFault(("clock",), ("time_s",), "time jumps by {p.time_s:g} s"),
    "overrun": KindOfFault(("clock",), ("time_s", "probability"), "the tick takes {p.time_s:g} s longer"),
}
"""Every kind of fault."""

_ALWAYS: Final = ("kind", "port", "first_tick", "duration_ticks", "seed")


@dataclass(frozen=True, slots=True)
class FaultPlan(Settings):
    """One fault.

    Raises:
        ConfigurationError: It makes no sense, or would do nothing.
    """

    kind: Annotated[str, OneOf(*KINDS)]
    """One of ``KINDS``."""
    port: Annotated[str, OneOf(*PORTS)]
    """One of ``PORTS``."""
    first_tick: Annotated[int, Range(0, 10**9)] = 0
    """Tick at which it begins, counted from the first use of the decorated port."""
    duration_ticks: Annotated[int, Range(0, 10**9)] = 0
    """For so many ticks; 0 is for ever."""
    probability: Annotated[float, Range(0.0, 1.0)] = 1.0
    """That it strikes in a tick of that time."""
    magnitude: Annotated[float, Range(-_GREAT, _GREAT)] = 0.0
    """Added, or for ``saturate`` the limit, for ``noise`` its standard deviation: N for forces, Nm for torques, rad for
    angles; ``bias-drift``: a second."""
    factor: Annotated[float, Range(-_GREAT, _GREAT)] = 1.0
    """What ``unit`` multiplies by."""
    delay_ticks: Annotated[int, Range(1, 100_000)] = 3
    """How late samples or commands come."""
    span_ticks: Annotated[int, Range(1, 100_000)] = 14
    """How many samples before the fault ``repeat`` repeats."""
    time_s: Annotated[float, Range(-_GREAT, _GREAT)] = 0.0
    """By how much the clock jumps, how much longer a tick takes, or how much a ``lag`` grows in a second, s."""
    channels: tuple[Annotated[int, Range(0, _MOST_CHANNELS - 1)], ...] = ()
    """Which components, from 0: Fx Fy Fz Tx Ty Tz, or joints; none means all. ``swap`` exchanges two."""
    honest: bool = True
    """Whether the device shows it: ``saturate`` marks its samples, ``repeat``, ``lag`` and ``delay`` keep old times."""
    seed: Annotated[int, Range(0, 2**63)] = 0
    """Of the fault's own random numbers; equal seeds on different ports or kinds give different ones."""

    @override
    def check(self) -> None:
        able, used = KINDS[self.kind].ports, KINDS[self.kind].settings
        if self.port not in able:
            raise ConfigurationError("port", self.port, f"a port that has {self.kind}: {' or '.join(able)}")
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name not in (*_ALWAYS, *used) and value != field.default:
                accepted = f"no such setting for {self.kind}; it has {', '.join(used) or 'none'}"
                raise ConfigurationError(field.name, value, accepted)
        for name, nothing in (("magnitude", 0.0), ("factor", 1.0), ("time_s", 0.0)):
            if name in used and getattr(self, name) == nothing:
                raise ConfigurationError(name, nothing, f"another value: {self.kind} would do nothing")
        positive = {"overrun": "time_s", "lag": "time_s", "saturate": "magnitude", "noise": "magnitude"}.get(self.kind)
        if positive is not None and getattr(self, positive) < 0.0:
            raise ConfigurationError(positive, getattr(self, positive), "a positive number")
        if self.kind == "swap" and len(set(self.channels)) != _PAIR:
            raise ConfigurationError("channels", self.channels, "two different ones to exchange")
        if self.port == "force_sensor":
            for channel in self.channels:
                require_whole("channels", channel, 0, WRENCH_CHANNELS - 1)

    @property
    def text(self) -> str:
        """What is reported when it happens."""
        return KINDS[self.kind].text.format(p=self)
