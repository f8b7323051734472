"""Faults of emulated devices at set times, so that a person can rehearse what to do."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, Self

from palpate.core.errors import ConfigurationError

EVENTS: Final = {
    "protective-stop": "the controller stops the arm, as at a collision",
    "emergency-stop": "the emergency stop is pressed; the drives lose their power",
    "program-end": "the control program is ended at the pendant",
    "cable-pulled": "the cable between this computer and the arm is pulled",
    "sensor-silent": "the force sensor stops sending",
    "sensor-cable": "the cable between the force sensor and its electronics is pulled",
}
"""All events; a rig has those that its devices can show."""
_EVENT: Final = re.compile(r"(start\+)?(\d+(?:\.\d+)?)s:([a-z-]+)")
_NS: Final = 1_000_000_000


@dataclass(frozen=True)
class PlannedEvent:
    """One event.

    Attributes:
        from_start: The time counts from the start of the devices, and not from the first motion of the arm.
    """

    name: str
    after_s: float
    from_start: bool

    @classmethod
    def of(cls, text: str, possible: Iterable[str]) -> Self:
        """Read an event as the option ``--event`` has it.

        Raises:
            ConfigurationError: It is none, or none of these devices.
        """
        found, names = _EVENT.fullmatch(text), [name for name in EVENTS if name in possible]
        if found is None or found[3] not in EVENTS:
            accepted = f"as in 12s:{names[0]} or start+12s:{names[0]}, with one of {', '.join(names)}"
            raise ConfigurationError("event", text, accepted)
        if found[3] not in names:
            raise ConfigurationError("event", text, f"one of {', '.join(names)}, which these devices can show")
        return cls(found[3], float(found[2]), bool(found[1]))


class Timetable:
    """Events that are still to come."""

    def __init__(self, events: Iterable[PlannedEvent]) -> None:
        self._events = sorted(events, key=lambda event: event.after_s)
        self._begun: dict[bool, int] = {}

    def due(self, now_ns: int, *, has_moved: bool) -> list[PlannedEvent]:
        """Take the events that are due by now."""
        self._begun.setdefault(True, now_ns)
        if has_moved:
            self._begun.setdefault(False, now_ns)
        due = [
            event for event in self._events
            if event.from_start in self._begun and now_ns >= self._begun[event.from_start] + event.after_s * _NS
        ]  # fmt: skip
        self._events = [event for event in self._events if event not in due]
        return due
