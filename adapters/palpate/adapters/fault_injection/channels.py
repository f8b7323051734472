"""Samples seen as plain rows of numbers, so that one fault serves both sensor ports."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

from palpate.core.errors import ConfigurationError
from palpate.core.ports.values import JointSample, JointVector, Validity, WrenchSample

SampleT = TypeVar("SampleT", WrenchSample, JointSample)


def channels_of(sample: WrenchSample | JointSample) -> tuple[float, ...]:
    """Fx Fy Fz Tx Ty Tz in N and Nm, or the joint angles in rad."""
    return (*sample.force_N, *sample.torque_Nm) if isinstance(sample, WrenchSample) else sample.position_rad


def with_channels(sample: SampleT, values: Sequence[float], validity: Validity) -> SampleT:
    """The sample with other numbers and another mark."""
    if isinstance(sample, WrenchSample):
        fx, fy, fz, tx, ty, tz = values
        return replace(sample, force_N=(fx, fy, fz), torque_Nm=(tx, ty, tz), validity=validity)
    return replace(sample, position_rad=tuple(values), validity=validity)


def changed(values: JointVector, channels: Sequence[int], change: Callable[[int, float], float]) -> JointVector:
    """The values with a change made to some of them.

    Args:
        values: The values.
        channels: Which to change; none means all.
        change: From place and value to the new value.

    Raises:
        ConfigurationError: There are not so many values.
    """
    if channels and max(channels) >= len(values):
        raise ConfigurationError("faults.channels", tuple(channels), f"numbers from 0 to {len(values) - 1}")
    chosen = channels or range(len(values))
    return tuple(change(i, value) if i in chosen else value for i, value in enumerate(values))


def aged(sample: SampleT, now_ns: int, max_age_ns: int) -> SampleT:
    """The sample, marked ``STALE`` if it is over age and nothing worse."""
    over_age = now_ns - sample.source_time_ns > max_age_ns
    return replace(sample, validity=Validity.STALE) if over_age and sample.validity is not Validity.INVALID else sample
