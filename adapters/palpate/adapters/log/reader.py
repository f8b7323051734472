"""Reads one log whole: one trial of its messages, in the order in which a recorder puts them, or what is wrong."""

import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from palpate.adapters.log.container import RECOVER, RawMessage, bytes_of, sound_messages, writer_of
from palpate.adapters.log.messages import decode_record
from palpate.adapters.log.records import (
    CallEntry,
    DecisionEntry,
    EndRecord,
    EventEntry,
    LossEntry,
    ReinforcementEntry,
    StartRecord,
    TickRecord,
)
from palpate.adapters.log.schema import (
    BY_ID,
    DECISION,
    END,
    EVENT,
    RECORDER,
    REINFORCEMENT,
    SCHEMA,
    START,
    TICK,
)
from palpate.adapters.log.tick_layout import FullLayout, decode_tick, layout_of
from palpate.core.errors import LogError
from palpate.core.trial import Outcome

RETRACTION: Final = "retraction"
"""Name of what follows a trip, as a phase; no task has it."""


@dataclass
class TrialLog:
    """One trial's log, decoded but for its ticks.

    Attributes:
        end: What it came to; None when the log ends before the trial did.
        counts: Messages by channel.
        disorder: The first message that is not where a recorder puts it: its tick, its channel and what is wrong.
    """

    path: str
    size_bytes: int
    start: StartRecord
    ticks: list[bytes] = field(default_factory=list)
    calls: list[CallEntry] = field(default_factory=list)
    decisions: list[DecisionEntry] = field(default_factory=list)
    reinforcements: list[ReinforcementEntry] = field(default_factory=list)
    events: list[EventEntry] = field(default_factory=list)
    losses: list[LossEntry] = field(default_factory=list)
    end: EndRecord | None = None
    raw_bytes: int = 0
    counts: Counter[int] = field(default_factory=Counter)
    disorder: tuple[int, str, str] | None = None

    @property
    def phases(self) -> list[tuple[int, str]]:
        """Where each phase begins, and its name; not of the first one, the lift. A trip begins the retraction."""
        begun = (event for event in self.events if event.name in ("phase", "trip"))
        return [(event.tick, RETRACTION if event.name == "trip" else event.detail) for event in begun]

    @property
    def trip(self) -> EventEntry | None:
        """The event that has the reason why supervisor, sensors or an operator ended the trial; None if none did."""
        cut = self.end is not None and self.end.outcome in (Outcome.SENSOR_FAULT.value, Outcome.STOPPED.value)
        names = ("trip", "end") if cut else ("trip",)
        return next((event for name in names for event in self.events if event.name == name), None)

    def records(self) -> Iterator[TickRecord]:
        """The ticks, decoded one by one.

        Raises:
            LogError: One is not a tick.
        """
        layout: FullLayout | None = None
        for number, payload in enumerate(self.ticks):
            if layout is not None:
                record = layout.unpack(payload)
                if record is not None:
                    yield record
                    continue
            try:
                record = decode_tick(payload)
            except Exception as error:
                raise LogError(self.path, f"message {number} of /tick", f"is no tick ({error})", RECOVER) from error
            layout = layout_of(record) or layout
            yield record


def read_log(path: str | Path) -> TrialLog:
    """Read a sound log.

    Raises:
        LogError: It is none: missing, empty, foreign, damaged, torn, of another schema, not one whole trial.
    """
    data = bytes_of(path)
    messages = list(sound_messages(str(path), data))
    return assemble(str(path), data, messages)


def assemble(path: str, data: bytes, messages: list[RawMessage]) -> TrialLog:
    """Make a trial of a log's messages.

    Raises:
        LogError: They are not those of one trial, or of another schema.
    """
    if not messages:
        who = writer_of(data)
        raise LogError(path, "", f"holds no messages of palpate's ({who})", "name a log that palpate recorded")
    start = _start_of(path, messages)
    log = TrialLog(path, len(data), start, raw_bytes=sum(len(m.payload) for m in messages))
    log.ticks = [m.payload for m in messages if m.channel == TICK.id]
    log.counts = Counter(m.channel for m in messages)
    for number, message in enumerate(messages):
        if message.channel == TICK.id:
            continue
        kind = BY_ID[message.channel]
        if kind is END and log.end is not None:
            raise LogError(path, f"message {number}", "a second end stands here", "one log holds one trial")
        try:
            file_in(log, message)
        except Exception as error:
            where = f"message {number} on {kind.topic}"
            raise LogError(path, where, f"is no {kind.message} ({error})", "it was not written by palpate") from error
        if kind is START and number:
            raise LogError(path, f"message {number}", "a second trial begins here", "one log holds one trial")
    log.disorder = _disorder(log, messages)
    return log


def _disorder(log: TrialLog, messages: list[RawMessage]) -> tuple[int, str, str] | None:
    """What comes of a tick stands after it and bears its time; time never goes back, and nothing follows the end."""
    told: dict[int, Iterator[DecisionEntry | ReinforcementEntry | EventEntry]] = {
        DECISION.id: iter(log.decisions),
        REINFORCEMENT.id: iter(log.reinforcements),
        EVENT.id: iter(log.events),
    }
    tick, time_ns, ended = -1, messages[0].time_ns, False
    for message in messages:
        kind = BY_ID[message.channel]
        if message.channel == TICK.id:
            tick += 1
            problem = "goes back in time" if message.time_ns < time_ns else ""
            time_ns = message.time_ns
        elif message.channel in told:
            place = next(told[message.channel]).tick
            problem = (
                f"is of tick {place}" if place != tick else "bears another time" if message.time_ns != time_ns else ""
            )
        else:
            problem = ""
        if ended and kind is not RECORDER:
            problem = "follows the end"
        if problem:
            return max(tick, 0), kind.topic, problem
        ended = ended or kind is END
    return None


def file_in(log: TrialLog, message: RawMessage) -> None:
    """Add what a message holds that is neither the start nor a tick."""
    if message.channel == DECISION.id:
        log.decisions.append(decode_record("Decision", DecisionEntry, message.payload))
    elif message.channel == REINFORCEMENT.id:
        log.reinforcements.append(decode_record("Reinforcement", ReinforcementEntry, message.payload))
    elif message.channel == EVENT.id:
        log.events.append(decode_record("Event", EventEntry, message.payload))
    elif message.channel == RECORDER.id:
        log.losses.append(decode_record("Recorder", LossEntry, message.payload))
    elif message.channel == END.id:
        log.end = decode_record("End", EndRecord, message.payload)
    elif message.channel != START.id:
        log.calls.append(decode_record("Call", CallEntry, message.payload))


def _start_of(path: str, messages: list[RawMessage]) -> StartRecord:
    first = messages[0]
    if first.channel != START.id:
        raise LogError(path, "", "does not begin with what the trial started with", "it cannot be replayed")
    try:
        made: Any = decode_record("Start", _Version, first.payload)
    except Exception as error:
        raise LogError(
            path, "message 0", f"is no start of a trial ({error})", "it was not written by palpate"
        ) from error
    if made.schema != SCHEMA:
        raise LogError(
            path, "", f"has schema {made.schema!r}", f"this palpate reads {SCHEMA!r}; use the one that wrote it"
        )
    try:
        return decode_record("Start", StartRecord, first.payload)
    except Exception as error:
        raise LogError(
            path, "message 0", f"lacks what a trial starts with ({error})", "it cannot be replayed"
        ) from error


@dataclass(frozen=True)
class _Version:
    schema: str


def learner_of_json(text: str) -> dict[str, Any] | None:
    """A learner's state from its text; None where nothing learns."""
    return dict(json.loads(text)) if text else None
