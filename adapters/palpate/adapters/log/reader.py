"""Read a complete log and reconstruct the trial from its messages in recorded order."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from palpate.adapters.log import records
from palpate.adapters.log.container import RawMessage, bytes_of, read_messages
from palpate.adapters.log.messages import R, decode
from palpate.adapters.log.schema import (
    BY_ID,
    CALL,
    DECISION,
    END,
    EVENT,
    RECORDER,
    REINFORCEMENT,
    SCHEMA,
    START,
    TICK,
    ChannelKind,
    message_class,
)
from palpate.core.errors import LogError
from palpate.core.trial import Outcome

_THIRD_PARTY: Final = "it was not written by palpate"
RETRACTION: Final = "retraction"
"""Name of the phase after a trip; no task uses it."""


@dataclass
class TrialLog:
    """One trial's log, decoded except for its ticks.

    Attributes:
        damage: Description and position of damage, or empty if undamaged. Only the part before the damage is read.
        missing: Messages that are missing according to the sequence numbers, or empty if there are none.
    """

    path: str
    size_bytes: int
    start: records.StartRecord
    ticks: list[bytes] = field(default_factory=list)
    calls: list[records.CallEntry] = field(default_factory=list)
    decisions: list[records.DecisionEntry] = field(default_factory=list)
    reinforcements: list[records.ReinforcementEntry] = field(default_factory=list)
    events: list[records.EventEntry] = field(default_factory=list)
    losses: list[records.LossEntry] = field(default_factory=list)
    end: records.EndRecord | None = None
    raw_bytes: int = 0
    counts: Counter[int] = field(default_factory=Counter)
    damage: str = ""
    missing: str = ""

    @property
    def phases(self) -> list[tuple[int, str]]:
        """Return the first tick and the name of each phase except the lift. A trip begins the retraction."""
        begun = (event for event in self.events if event.name in ("phase", "trip"))
        return [(event.tick, RETRACTION if event.name == "trip" else event.detail) for event in begun]

    @property
    def outcome(self) -> str:
        """Return the outcome in words, or an empty string if unknown. A trip takes precedence over the task report."""
        if self.end is None:
            return ""
        return Outcome.TRIPPED.value if any(event.name == "trip" for event in self.events) else self.end.outcome

    @property
    def trip(self) -> records.EventEntry | None:
        """Return the event that says why the supervisor, a sensor or the operator ended the trial, or None."""
        cut = self.end is not None and self.end.outcome in (Outcome.SENSOR_FAULT.value, Outcome.STOPPED.value)
        names = ("trip", "end") if cut else ("trip",)
        return next((event for name in names for event in self.events if event.name == name), None)

    def records(self) -> Iterator[records.TickRecord]:
        """Yield the decoded ticks.

        Raises:
            LogError: A message is not a tick.
        """
        for number, payload in enumerate(self.ticks):
            yield _decoded(self.path, f"message {number} of /tick", "is no Tick", records.TickRecord, payload)


def read_log(path: str | Path) -> TrialLog:
    """Read a log, up to its end or the first damaged part.

    Raises:
        LogError: The log is missing or empty, is from another program or in a different format, is not a single trial,
            or is damaged before the trial's start.
    """
    data = bytes_of(path)
    messages, damage = read_messages(str(path), data)
    return assemble(str(path), data, messages, damage)


def assemble(path: str, data: bytes, messages: list[RawMessage], damage: str = "") -> TrialLog:
    """Assemble a trial from the messages in a log.

    Raises:
        LogError: The messages are not from a single trial, or have a different format.
    """
    if not messages and damage:
        raise LogError(path, "", f"contains nothing readable: {damage}", "it can only be deleted")
    if not messages:
        raise LogError(path, "", "holds no messages of palpate's", "name a log that palpate recorded")
    # Tools without numbers write zeros.
    numbered = enumerate(messages) if messages[-1].sequence else ()
    gap = next((place for place, message in numbered if message.sequence != place), None)
    if damage and gap:
        messages, gap = messages[:gap], None
    log = TrialLog(path, len(data), _start_of(path, messages), damage=damage)
    log.missing = "" if gap is None else _missing(messages, gap)
    log.raw_bytes = sum(len(message.payload) for message in messages)
    log.ticks = [message.payload for message in messages if message.channel == TICK.id]
    log.counts = Counter(message.channel for message in messages)
    lists: dict[ChannelKind, list[Any]] = {
        CALL: log.calls, DECISION: log.decisions, REINFORCEMENT: log.reinforcements, EVENT: log.events,
        RECORDER: log.losses,
    }  # fmt: skip
    for number, message in enumerate(messages):
        kind = BY_ID[message.channel]
        if (kind is START and number) or (kind is END and log.end is not None):
            raise LogError(path, f"message {number}", f"is a second {kind.topic}", "one log holds one trial")
        if kind not in (START, TICK):
            where = f"message {number} on {kind.topic}"
            found: Any = _decoded(path, where, f"is no {kind.message}", kind.record, message.payload)
            if kind is END:
                log.end = found
            else:
                lists[kind].append(found)
    return log


def _missing(messages: list[RawMessage], place: int) -> str:
    """Describe the gaps in the sequence numbers."""
    ticks = sum(message.channel == TICK.id for message in messages[:place])
    more = messages[-1].sequence - len(messages)
    return f"message {place}, after tick {ticks - 1}, is missing" + (f" (and {more} more)" if more > 0 else "")


def _start_of(path: str, messages: list[RawMessage]) -> records.StartRecord:
    first = messages[0]
    if first.channel != START.id:
        raise LogError(path, "", "does not begin with the start record", "it cannot be replayed")
    try:
        schema = message_class(START.message).FromString(first.payload).schema
    except Exception as error:
        raise LogError(path, "message 0", f"is not a start record ({error})", _THIRD_PARTY) from error
    if schema != SCHEMA:
        raise LogError(
            path, "", f"has format {schema!r}", f"this version reads {SCHEMA!r}; use the version that wrote it"
        )
    return _decoded(path, "message 0", "lacks the start record of a trial", records.StartRecord, first.payload)


def _decoded(path: str, where: str, problem: str, kind: type[R], payload: bytes) -> R:
    try:
        return decode(kind, payload)
    except Exception as error:
        raise LogError(path, where, f"{problem} ({error})", _THIRD_PARTY) from error
