"""Takes down what the control loop holds, tick by tick, and what the task reports, as the messages of a log."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final, TypeAlias

from typing_extensions import override

from palpate.adapters.log.container import RawMessage, message_record
from palpate.adapters.log.messages import encode_record, encode_tick
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
from palpate.adapters.log.schema import CALL, DECISION, END, EVENT, RECORDER, REINFORCEMENT, START, TICK, ChannelKind
from palpate.adapters.log.sink import Sink
from palpate.core.control_loop import ARM, LoopObserver, UnfinishedTick
from palpate.core.errors import DeviceError, LogError, PalpateError
from palpate.core.ports import AppliedCommand, JointCommand, Snapshot
from palpate.core.trial import TrialReport

_BATCH: Final = 35
"""Messages of one chunk, a quarter of a second of ticks: what a kill can cost. Fewer cost more time each."""
_Tick: TypeAlias = tuple[int, Snapshot, JointCommand, AppliedCommand]
"""A tick that came to a command; the first is its deadline, ns."""
_UNFIT: Final = (ValueError, TypeError, OverflowError, KeyError)
"""What packing raises for a value that the message cannot hold, such as a number of more than 64 bits."""
_NOTHING: Final = UnfinishedTick("", None, None, None, None)


class FlightRecorder(LoopObserver):
    """One log after the other, trial by trial. It only keeps what it is given; the sink has that packed.

    Args:
        stop_on_trouble: A message that cannot be kept ends the trial instead of being reported.
    """

    def __init__(self, sink: Sink, *, stop_on_trouble: bool = False) -> None:
        self._sink, self._stop = sink, stop_on_trouble
        self.troubles: list[str] = []
        self._recording = False
        self._clear()

    def _clear(self) -> None:
        self._tick, self._now_ns = -1, 0
        self._deadline_ns: int | None = None
        self._unfinished = _NOTHING
        self._report: TrialReport | None = None
        self._events = self._decisions = self._settled = 0
        self._batch: list[_Message] = []
        self._sequence = 0
        self._start: Callable[[], StartRecord] | None = None
        self._counterfactual: Callable[[], bool] | None = None

    def begin(
        self,
        path: Path,
        metadata: dict[str, str],
        start: Callable[[], StartRecord],
        counterfactual: Callable[[], bool] | None = None,
    ) -> None:
        """Open a log.

        Args:
            metadata: What the file tells of its trial without being decoded.
            start: Gives what the trial started with; asked when the task has begun, or could not begin.
            counterfactual: For a what-if: whether the trial has left the recorded path, and messages are to say so.
        """
        if self._recording:
            raise LogError(str(path), "", "the log before is still open", "end it first")
        self._clear()
        self._sink.open(path, metadata)
        self._start, self._counterfactual = start, counterfactual
        self._recording = True

    def end(self, record: EndRecord | None) -> None:
        """Close the log with the trial's outcome; with None it ends before the trial does."""
        if not self._recording:
            return
        self._put_start()
        if self._deadline_ns is not None:
            tick = self._unfinished
            self._keep_tick(TickRecord(self._tick, tick.time_ns, self._deadline_ns, tick.wrench, tick.joints))
        self._follow(final=True)
        if record is not None:
            self._keep(END, replace(record, counterfactual=self._off_path()))
        self._hand_over()
        self._recording = False
        self._sink.close()
        self._ask_sink()

    @property
    def failed_port(self) -> str:
        """The port whose call ended the trial; empty where it was none."""
        return self._unfinished.calling

    @override
    def begun(self, start_ns: int, report: TrialReport) -> None:
        self._now_ns, self._report = start_ns, report
        self._call(CallEntry(tick=self._tick, port="clock", call="now_ns", time_ns=start_ns))

    @override
    def waited(self, tick: int, deadline_ns: int) -> None:
        self._tick, self._deadline_ns = tick, deadline_ns

    @override
    def sent(self, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> None:
        report, deadline_ns = self._report, self._deadline_ns
        if not self._recording or report is None or deadline_ns is None:
            return
        self._now_ns, self._deadline_ns = snapshot.time_ns, None
        if self._counterfactual is None:
            # Packed later, many at once: between two ticks of a loop every line of code runs on cold caches.
            self._keep(TICK, (deadline_ns, snapshot, command, applied))
        else:
            parts = snapshot.wrench, snapshot.joints, command.position_rad, applied, self._off_path()
            self._keep_tick(TickRecord(snapshot.tick, snapshot.time_ns, deadline_ns, *parts))
        if len(report.events) != self._events or len(report.decisions) != self._decisions:
            self._follow()
        if self._stop and self.troubles:
            raise DeviceError("flight recorder", self.troubles[-1])

    @override
    def failed(self, error: BaseException, tick: UnfinishedTick) -> None:
        self._unfinished = tick
        if tick.time_ns is not None:
            self._now_ns = tick.time_ns
        if tick.calling and isinstance(error, PalpateError):
            asked = tick.command
            self._call(
                CallEntry(
                    tick=self._tick,
                    port=tick.calling,
                    call="send" if tick.calling == ARM else "read",
                    asked_rad=None if asked is None else asked.position_rad,
                    error=type(error).__name__,
                    text=str(error),
                )
            )

    @override
    def stopped(self, error: BaseException | None) -> None:
        stop = CallEntry(tick=self._tick, port=ARM, call="stop")
        if isinstance(error, PalpateError):
            stop = replace(stop, error=type(error).__name__, text=str(error))
        if error is None or isinstance(error, PalpateError):
            self._call(stop)

    # Inside.

    def _call(self, entry: CallEntry) -> None:
        """Record a port call that is none of a tick's four: one that failed, or one outside the loop."""
        if self._recording:
            self._put_start()
            self._keep(CALL, entry)

    def _put_start(self) -> None:
        """Before anything else: the task has begun, or never will, and what the trial starts with is known."""
        if self._start is not None:
            start, self._start = self._start, None
            self._keep(START, start())
            self._hand_over()

    def _off_path(self) -> bool:
        return self._counterfactual is not None and self._counterfactual()

    def _follow(self, *, final: bool = False) -> None:
        """Take over what the task has newly reported.

        Args:
            final: It is not asked again: what a decision earned is told even if none came after it.
        """
        report = self._report
        if report is None:
            return
        for event in report.events[self._events :]:
            self._tell(EVENT, EventEntry(tick=event.tick, name=event.name, detail=event.detail))
        self._events = len(report.events)
        if not final and len(report.decisions) == self._decisions:
            return
        for number, decision in enumerate(report.decisions[self._settled :], start=self._settled):
            if number >= self._decisions:
                self._tell(DECISION, DecisionEntry.of(number, decision, report.temperature))
            if decision.reinforcement is not None:
                earned = ReinforcementEntry(tick=self._tick, number=number, reinforcement=decision.reinforcement)
                self._tell(REINFORCEMENT, earned)
                self._settled = number + 1
        self._decisions = len(report.decisions)

    def _tell(self, kind: ChannelKind, entry: EventEntry | DecisionEntry | ReinforcementEntry) -> None:
        if self._off_path():
            entry = replace(entry, counterfactual=True)
        self._keep(kind, entry)

    def _keep_tick(self, record: TickRecord) -> None:
        self._deadline_ns = None
        self._keep(TICK, record)

    def _keep(self, kind: ChannelKind, record: object) -> None:
        self._batch.append((kind, self._now_ns, self._sequence, self._tick, record))
        self._sequence += 1
        if len(self._batch) >= _BATCH:
            self._hand_over()

    def _hand_over(self) -> None:
        batch, self._batch = self._batch, []
        if batch:
            self._sink.put(partial(_packed, batch, self.troubles))
            self._ask_sink()

    def _ask_sink(self) -> None:
        while (trouble := self._sink.trouble()) is not None:
            self.troubles.append(trouble)


_Message: TypeAlias = tuple[ChannelKind, int, int, int, object]
"""A message that is not packed yet: channel, time in ns, sequence number, tick, and the record, or a :data:`_Tick`."""


def _packed(batch: Sequence[_Message], troubles: list[str]) -> bytes:
    """The MCAP records of messages. Recording does not end what it records: what cannot be packed is lost, and told."""
    records = []
    for kind, time_ns, sequence, tick, record in batch:
        channel = kind
        try:
            payload = encode_tick(*record) if isinstance(record, tuple) else encode_record(kind.message, record)
        except _UNFIT as error:
            troubles.append(f"a message on {kind.topic} at tick {tick} cannot be packed ({error})")
            text = f"a message on {kind.topic} is missing"
            loss = LossEntry(tick=tick, problem="cannot be packed", text=text, dropped_messages=1)
            channel, payload = RECORDER, encode_record("Recorder", loss)
        records.append(message_record(RawMessage(channel.id, time_ns, payload, sequence)))
    return b"".join(records)
