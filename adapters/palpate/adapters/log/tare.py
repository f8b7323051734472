"""The zero of a trial's force sensor, from its log: what has to be taken from every sample."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import isfinite

from palpate.adapters.log.reader import TrialLog
from palpate.adapters.log.tick_layout import TickRecord
from palpate.core.trial import Phase
from palpate.core.values import Validity

_NUMBERS = re.compile(r"(\S+) (\S+) (\S+) N, (\S+) (\S+) (\S+) N m\b")


@dataclass(frozen=True)
class Tare:
    """A zero, and where it is from.

    Attributes:
        bias: Fx Fy Fz in N, Tx Ty Tz in N m, in the samples' own frame.
        origin: In words.
    """

    bias: tuple[float, ...]
    origin: str


def tare_of(log: TrialLog, ticks: list[TickRecord]) -> Tare:
    """The zero that the task found; without one, the mean while the arm was at rest; without that, none.

    Args:
        log: The trial.
        ticks: Its ticks, decoded.
    """
    for event in log.events:
        found = _NUMBERS.match(event.detail) if event.name == "tare" else None
        if found is not None:
            bias = _floats(found.groups())
            if bias is not None:
                return Tare(bias, f"tare event at tick {event.tick}")
    at_rest = _at_rest(log, ticks)
    if at_rest:
        mean = tuple(sum(column) / len(at_rest) for column in zip(*at_rest, strict=True))
        return Tare(mean, f"mean of the settle phase, {len(at_rest)} samples, because there is no tare event")
    return Tare((0.0,) * 6, "nothing: raw, for there is neither a tare event nor a settle phase")


def _at_rest(log: TrialLog, ticks: list[TickRecord]) -> list[tuple[float, ...]]:
    phases = [(event.tick, event.detail) for event in log.events if event.name == "phase"]
    samples: list[tuple[float, ...]] = []
    for record in ticks:
        begun = [phase for tick, phase in phases if tick <= record.tick]
        wrench = record.wrench
        if begun and begun[-1] == Phase.SETTLE.value and wrench is not None and wrench.validity is Validity.VALID:
            samples.append((*wrench.force_N, *wrench.torque_Nm))
    return samples


def _floats(texts: tuple[str, ...]) -> tuple[float, ...] | None:
    try:
        values = tuple(float(text) for text in texts)
    except ValueError:
        return None
    return values if all(isfinite(value) for value in values) else None
