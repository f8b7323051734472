"""Turns what passes the ports, and what the core reports, into the messages of a log."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Protocol

from palpate.adapters.log.records import (
    CallEntry,
    DecisionEntry,
    EndRecord,
    EventEntry,
    LossEntry,
    ReinforcementEntry,
    StartRecord,
    encode_call,
    encode_record,
)
from palpate.adapters.log.schema import CALL, DECISION, END, EVENT, RECORDER, REINFORCEMENT, START, TICK
from palpate.adapters.log.tick_layout import TickRecord, encode_tick, full_layout
from palpate.adapters.recording.sinks import FRAME, MESSAGE, Opening, Sink
from palpate.core.errors import DeviceError, LogError
from palpate.core.trial import TrialReport
from palpate.core.values import AppliedCommand, JointCommand, JointSample, WrenchSample

_BATCH_TICKS: Final = 14
"""Ticks handed over at once, a tenth of a second: one system call for all of them."""


class HasReport(Protocol):
    """Whoever runs the trial."""

    @property
    def report(self) -> TrialReport:
        """The account of the trial so far."""


class FlightRecorder:
    """One log after the other, trial by trial. It packs and queues; the sink does the rest.

    Args:
        sink: Takes the messages.
        stop_on_trouble: A message that cannot be kept ends the trial instead of being counted.
    """

    def __init__(self, sink: Sink, *, stop_on_trouble: bool = False) -> None:
        self._sink, self._stop = sink, stop_on_trouble
        self.troubles: list[str] = []
        self.dropped_messages = 0
        self._recording = False
        self._task: HasReport | None = None
        self._clear()

    def _clear(self) -> None:
        self._tick, self._now_ns, self._deadline_ns = -1, 0, 0
        self._open_tick = False
        self._time_ns: int | None = None
        self._wrench: WrenchSample | None = None
        self._joints: JointSample | None = None
        self._asked: JointCommand | None = None
        self._applied: AppliedCommand | None = None
        self._events = self._decisions = self._settled = 0
        self._batch: list[bytes] = []
        self._lost: LossEntry | None = None
        self._start: Callable[[], StartRecord] | None = None

    @property
    def recording(self) -> bool:
        """Whether a log is open."""
        return self._recording

    def begin(self, opening: Opening, task: HasReport, start: Callable[[], StartRecord]) -> None:
        """Open a log.

        Args:
            opening: Which file.
            task: Its report is read as the trial goes on.
            start: Gives what the trial started with; asked at the first port call, when the task has begun.

        Raises:
            LogError: One is open already.
        """
        if self._recording:
            raise LogError(str(opening.path), "", "the log before is still open", "end it first")
        self._clear()
        self._task, self._start = task, start
        self._sink.open(opening)
        self._recording = True

    def end(self, record: EndRecord) -> None:
        """Close the log with what the trial came to."""
        if not self._recording:
            return
        self._recording = False
        self._begun()
        self._finish_tick()
        self._follow(final=True)
        self._message(END.id, encode_record("End", record))
        self._sink.close(b"".join(self._batch))
        self._batch = []
        self._ask_sink()

    @property
    def tick(self) -> int:
        """The tick that is under way; -1 before the first."""
        return self._tick

    # What the decorated ports tell. Each port's first word in a tick goes into the tick's message.

    def slept(self, deadline_ns: int) -> None:
        """The loop begins a tick: it slept until then."""
        if self._recording:
            self._begun()
            self._finish_tick()
            self._tick += 1
            self._open_tick = True
            self._deadline_ns = deadline_ns

    def read_clock(self, time_ns: int) -> None:
        """The clock was read."""
        if self._recording:
            self._now_ns = time_ns
            if self._open_tick and self._time_ns is None:
                self._time_ns = time_ns
            else:
                self._begun()
                self.call(CallEntry(tick=self._tick, port="clock", call="now_ns", time_ns=time_ns))

    def read_wrench(self, sample: WrenchSample) -> None:
        """The force sensor was read."""
        if self._recording:
            if self._open_tick and self._wrench is None:
                self._wrench = sample
            else:
                self.call(CallEntry(tick=self._tick, port="force_sensor", call="read", wrench=sample))

    def read_joints(self, sample: JointSample) -> None:
        """The encoders were read."""
        if self._recording:
            if self._open_tick and self._joints is None:
                self._joints = sample
            else:
                self.call(CallEntry(tick=self._tick, port="joint_encoder", call="read", joints=sample))

    def sent(self, command: JointCommand, applied: AppliedCommand) -> None:
        """A command was sent, and so much of it applied.

        Raises:
            DeviceError: Something could not be kept, and the trial is to end for that.
        """
        if not self._recording:
            return
        wrench, joints, time_ns = self._wrench, self._joints, self._time_ns
        if not self._open_tick:
            self.call(
                CallEntry(tick=self._tick, port="arm", call="send", asked_rad=command.position_rad, applied=applied)
            )
        elif wrench is None or joints is None or time_ns is None:
            self._asked, self._applied = command, applied
            self._finish_tick()
        else:
            asked_rad, applied_rad = command.position_rad, applied.position_rad
            layout = full_layout(len(asked_rad), len(joints.position_rad), len(applied_rad), wrench.frame)
            payload = layout.pack(
                self._tick, time_ns, self._deadline_ns, wrench, joints, asked_rad, applied_rad, applied.reason
            )
            self._batch.append(FRAME.pack(MESSAGE, TICK.id, time_ns, len(payload)) + payload)
            self._open_tick = False
            self._wrench = self._joints = self._time_ns = None
        self._follow()
        if len(self._batch) >= _BATCH_TICKS:
            self._hand_over()

    def call(self, entry: CallEntry) -> None:
        """A port call that no tick message holds."""
        if self._recording:
            self._begun()
            self._message(CALL.id, encode_call(entry))

    # Inside.

    def _begun(self) -> None:
        """At the first word from any port: the task has begun, and what the trial starts with is known."""
        if self._start is not None:
            start, self._start = self._start, None
            self._message(START.id, encode_record("Start", start()))

    def _finish_tick(self) -> None:
        """Keep a tick in which not everything happened."""
        if self._open_tick:
            self._open_tick = False
            asked = None if self._asked is None else self._asked.position_rad
            record = TickRecord(
                self._tick, self._time_ns, self._deadline_ns, self._wrench, self._joints, asked, self._applied
            )
            self._message(TICK.id, encode_tick(record))
            self._time_ns = self._wrench = self._joints = self._asked = self._applied = None

    def _follow(self, *, final: bool = False) -> None:
        """Take over what the task has newly reported."""
        if self._task is None:
            return
        report = self._task.report
        if len(report.events) > self._events:
            for event in report.events[self._events :]:
                entry = EventEntry(tick=event.tick, name=event.name, detail=event.detail)
                self._message(EVENT.id, encode_record("Event", entry))
            self._events = len(report.events)
        if len(report.decisions) > self._decisions or (final and self._settled < self._decisions):
            self._follow_decisions(report)

    def _follow_decisions(self, report: TrialReport) -> None:
        for number, decision in enumerate(report.decisions[self._settled :], start=self._settled):
            if number >= self._decisions:
                chosen = DecisionEntry(
                    tick=decision.tick,
                    number=number,
                    symbol=decision.symbol,
                    state=decision.state,
                    action=decision.action,
                    source=decision.source,
                    temperature=report.temperature,
                )
                self._message(DECISION.id, encode_record("Decision", chosen))
            if decision.reinforcement is not None:
                earned = ReinforcementEntry(tick=self._tick, number=number, reinforcement=decision.reinforcement)
                self._message(REINFORCEMENT.id, encode_record("Reinforcement", earned))
                self._settled = number + 1
        self._decisions = len(report.decisions)

    def _message(self, channel: int, payload: bytes) -> None:
        self._batch.append(FRAME.pack(MESSAGE, channel, self._now_ns, len(payload)) + payload)

    def _hand_over(self) -> None:
        batch, self._batch = self._batch, []
        if self._lost is not None:
            # There is room again, or so it seems: first of all the log must tell what it lacks.
            mark = encode_record("Recorder", self._lost)
            batch.insert(0, FRAME.pack(MESSAGE, RECORDER.id, self._now_ns, len(mark)) + mark)
        if self._sink.put(b"".join(batch)):
            self._lost = None
        else:
            self._lose(len(batch))
        self._ask_sink()
        if self._stop and self.troubles:
            raise DeviceError("flight recorder", self.troubles[-1])

    def _lose(self, messages: int) -> None:
        before = self._lost
        known = 0 if before is None else before.dropped_messages
        # The mark itself was in the batch, if there was one.
        lost = messages - (before is not None)
        self.dropped_messages += lost
        first = self._tick - _BATCH_TICKS + 1 if before is None else before.first_dropped_tick
        self._lost = LossEntry(
            tick=self._tick,
            problem="queue full",
            text="the writer was behind",
            dropped_messages=known + lost,
            first_dropped_tick=first,
            last_dropped_tick=self._tick,
        )
        if before is None:
            self.troubles.append(f"the writer is behind and the queue is full: messages are lost from tick {first} on")

    def _ask_sink(self) -> None:
        trouble = self._sink.trouble()
        if trouble is not None:
            self.troubles.append(trouble)
