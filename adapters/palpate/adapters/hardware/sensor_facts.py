"""Properties of a rig's force sensor, combined from the rig file and the sensor's reports."""

from abc import abstractmethod
from dataclasses import asdict
from math import isclose
from typing import Any, Final, Protocol, runtime_checkable

from palpate.adapters.config import SensorFactsTable
from palpate.core.errors import ConfigurationError
from palpate.core.ports import SensorFacts, Vector3

_REMEDY: Final = "palpate rig doctor --rig FILE measures the noise and shows the line to write below [force_sensor]"
_SAME_RATE: Final = 0.01
"""Accepted relative difference between the reported rate and the rate in the rig file, which may have been measured."""


@runtime_checkable
class ReportsFacts(Protocol):
    """A force sensor that reports its properties; adapters are not required to do so."""

    @abstractmethod
    def reported_facts(self) -> SensorFactsTable:
        """Return the properties reported by the device after ``configure``."""


def reported_by(sensor: object) -> SensorFactsTable:
    """Return the properties that a configured sensor reports, or an empty mapping if it reports none."""
    return sensor.reported_facts() if isinstance(sensor, ReportsFacts) else SensorFactsTable()


def missing_facts(stated: SensorFactsTable, reported: SensorFactsTable) -> tuple[str, ...]:
    """Return the names of the properties that neither source provides."""
    known = _known(reported) | _known(stated)
    return tuple(name for name in asdict(stated) if name != "frame" and name not in known)


def gathered(stated: SensorFactsTable, reported: SensorFactsTable) -> SensorFacts:
    """Return the properties for a run. A rig file may narrow a range, but must not contradict the sensor.

    Raises:
        ConfigurationError: A property is missing, or the rig file contradicts the sensor.
    """
    missing = missing_facts(stated, reported)
    if missing:
        accepted = f"a table that states {', '.join(missing)}, which the sensor does not report; {_REMEDY}"
        raise ConfigurationError(stated.TABLE, _known(stated) or None, accepted)
    for name in ("range_N", "range_Nm"):
        _require_within(name, getattr(stated, name), getattr(reported, name))
    if stated.rate_Hz is not None and reported.rate_Hz is not None:
        same = isclose(stated.rate_Hz, reported.rate_Hz, rel_tol=_SAME_RATE)
        stated.require("rate_Hz", same, f"{reported.rate_Hz:g}, as the sensor is set")
    same = None in (stated.frame, reported.frame) or stated.frame == reported.frame
    stated.require("frame", same, f"{reported.frame}, as the sensor reports it")
    return SensorFacts(**(_known(reported) | _known(stated)))


def _known(facts: SensorFactsTable) -> dict[str, Any]:
    return {name: value for name, value in asdict(facts).items() if value is not None}


def _require_within(name: str, stated: Vector3 | None, reported: Vector3 | None) -> None:
    if stated is None or reported is None:
        return
    if any(value > most for value, most in zip(stated, reported, strict=True)):
        accepted = f"at most {', '.join(f'{most:g}' for most in reported)}, what the sensor reports"
        raise ConfigurationError(SensorFactsTable.TABLE + "." + name, stated, accepted)
