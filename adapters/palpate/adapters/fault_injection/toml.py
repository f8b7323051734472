"""Faults from the tables ``[[faults]]`` of a TOML file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from palpate.adapters.config.toml import overlay
from palpate.adapters.fault_injection.plan import KINDS, PORTS, FaultPlan
from palpate.core.errors import ConfigurationError

_ANY: Final = FaultPlan("drop", "force_sensor")
"""Something to lay a table over; kind and port are always replaced."""


def fault_plans(table: Mapping[str, Any]) -> list[FaultPlan]:
    """The plans of a TOML document; an empty list when it has no ``[[faults]]``.

    Args:
        table: The document. Its other tables are not looked at.

    Raises:
        ConfigurationError: Unknown, ill-typed or senseless settings, by the name ``faults[NUMBER].FIELD``.
    """
    entries = table.get("faults", [])
    if not isinstance(entries, list):
        raise ConfigurationError("faults", entries, "tables [[faults]]")
    return [_plan(f"faults[{number}]", entry) for number, entry in enumerate(entries)]


def _plan(where: str, entry: Any) -> FaultPlan:
    if not isinstance(entry, Mapping):
        raise ConfigurationError(where, entry, "a table")
    for name, known in (("kind", tuple(KINDS)), ("port", PORTS)):
        if name not in entry:
            raise ConfigurationError(f"{where}.{name}", None, f"one of {', '.join(known)}")
    try:
        # Not in the overlay: no type of TOML is "a number or nothing".
        time_s = entry.get("at_time_s")
        rest = {key: value for key, value in entry.items() if key != "at_time_s"}
        return replace(overlay(_ANY, rest), at_time_s=time_s)
    except ConfigurationError as error:
        raise ConfigurationError(f"{where}.{error.field}", error.value, error.accepted) from error
