"""What shall go wrong, where and when: one fault, checked before anything runs."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Final

from palpate.core.errors import ConfigurationError, require_in, require_whole

_SENSORS: Final = ("force_sensor", "joint_encoder")
PORTS: Final = (*_SENSORS, "arm", "clock")
"""The ports, by the names of their fields in ``palpate.core.control_loop.Ports``."""

WRENCH_CHANNELS: Final = 6
_MOST_CHANNELS: Final = 64
_GREAT: Final = 1e9


@dataclass(frozen=True, slots=True)
class KindOfFault:
    """What may be said of one kind.

    Attributes:
        ports: Where it may happen.
        settings: Fields of a plan that mean something to it, besides kind, port, time and seed.
        text: What is told when it happens; may name fields of the plan.
    """

    ports: tuple[str, ...]
    settings: tuple[str, ...]
    text: str


KINDS: Final[dict[str, KindOfFault]] = {
    "drop": KindOfFault((*_SENSORS, "arm"), ("probability",), "lost on its way"),
    "delay": KindOfFault((*_SENSORS, "arm"), ("delay_ticks",), "{p.delay_ticks} ticks late"),
    "duplicate": KindOfFault(_SENSORS, ("probability",), "the sample before once more"),
    "freeze": KindOfFault(_SENSORS, ("channels",), "values stand still while number and time go on"),
    "repeat": KindOfFault(_SENSORS, ("span_ticks", "honest"), "the last {p.span_ticks} samples again"),
    "bias-drift": KindOfFault(_SENSORS, ("magnitude", "channels"), "drifting by {p.magnitude:g} a second"),
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

_ALWAYS: Final = ("kind", "port", "first_tick", "at_time_s", "duration_ticks", "seed")


@dataclass(frozen=True, slots=True)
class FaultPlan:
    """One fault.

    Attributes:
        kind: One of ``KINDS``.
        port: One of ``PORTS``.
        first_tick: Tick at which it begins, counted from the first use of the decorated port.
        at_time_s: Time at which it begins instead, counted from the first use of the decorated port, s.
        duration_ticks: For so many ticks; 0 is for ever.
        probability: That it strikes in a tick of that time.
        magnitude: Added, or for ``saturate`` the limit: N for forces, Nm for torques, rad for angles; a second for
            ``bias-drift``.
        factor: What ``unit`` multiplies by.
        delay_ticks: How late samples or commands come.
        span_ticks: How many samples before the fault ``repeat`` repeats.
        time_s: By how much the clock jumps, or how much longer a tick takes, s.
        channels: Which components, from 0: Fx Fy Fz Tx Ty Tz, or joints; none means all.
        honest: Whether the device owns up: ``saturate`` marks its samples, ``repeat`` keeps old numbers and times.
        seed: Of the fault's own random numbers; equal seeds on different ports or kinds give different ones.

    Raises:
        ConfigurationError: It makes no sense, or would do nothing.
    """

    kind: str
    port: str
    first_tick: int = 0
    at_time_s: float | None = None
    duration_ticks: int = 0
    probability: float = 1.0
    magnitude: float = 0.0
    factor: float = 1.0
    delay_ticks: int = 3
    span_ticks: int = 14
    time_s: float = 0.0
    channels: tuple[int, ...] = ()
    honest: bool = True
    seed: int = 0

    def __post_init__(self) -> None:
        _require_name("kind", self.kind, tuple(KINDS))
        _require_name("port", self.port, PORTS)
        able = KINDS[self.kind].ports
        if self.port not in able:
            raise ConfigurationError("port", self.port, f"a port that knows {self.kind}: {' or '.join(able)}")
        self._check_time()
        self._check_settings()

    def _check_time(self) -> None:
        require_whole("first_tick", self.first_tick, 0, 10**9)
        require_whole("duration_ticks", self.duration_ticks, 0, 10**9)
        require_whole("seed", self.seed, 0, 2**63)
        if self.at_time_s is not None:
            _require_number("at_time_s", self.at_time_s, 0.0, _GREAT)
            if self.first_tick:
                raise ConfigurationError("at_time_s", self.at_time_s, "either first_tick or at_time_s, not both")

    def _check_settings(self) -> None:
        used = KINDS[self.kind].settings
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name not in (*_ALWAYS, *used) and value != field.default:
                accepted = f"no such setting for {self.kind}; it knows {', '.join(used) or 'none'}"
                raise ConfigurationError(field.name, value, accepted)
        _require_number("probability", self.probability, 0.0, 1.0)
        require_whole("delay_ticks", self.delay_ticks, 1, 100_000)
        require_whole("span_ticks", self.span_ticks, 1, 100_000)
        for name, nothing in (("magnitude", 0.0), ("factor", 1.0), ("time_s", 0.0)):
            value = getattr(self, name)
            _require_number(name, value, -_GREAT, _GREAT)
            if name in used and value == nothing:
                raise ConfigurationError(name, value, f"another value: {self.kind} would do nothing")
        if (self.kind == "overrun" and self.time_s < 0.0) or (self.kind == "saturate" and self.magnitude < 0.0):
            name = "time_s" if self.kind == "overrun" else "magnitude"
            raise ConfigurationError(name, getattr(self, name), "a positive number")
        most = WRENCH_CHANNELS if self.port == "force_sensor" else _MOST_CHANNELS
        for channel in self.channels:
            require_whole("channels", channel, 0, most - 1)

    @property
    def text(self) -> str:
        """What is told when it happens."""
        return KINDS[self.kind].text.format(p=self)


def _require_number(field: str, value: float, low: float, high: float) -> None:
    if isinstance(value, bool):
        raise ConfigurationError(field, value, "a number")
    require_in(field, value, low, high)


def _require_name(field: str, value: str, known: Sequence[str]) -> None:
    if value not in known:
        near = difflib.get_close_matches(value, known, n=1, cutoff=0.5) if isinstance(value, str) else []
        hint = f"; did you mean {near[0]}?" if near else ""
        raise ConfigurationError(field, value, f"one of {', '.join(known)}{hint}")
