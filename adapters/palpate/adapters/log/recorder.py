"""Turns what the control loop holds, tick by tick, and what the task reports into the messages of a log."""

import struct
from collections.abc import Callable
from dataclasses import replace
from typing import Final, TypeAlias

from typing_extensions import override

from palpate.adapters.log.messages import encode_record
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
from palpate.adapters.log.tick_layout import full_layout
from palpate.adapters.log.writer_client import Opening, Sink
from palpate.adapters.log.writer_process import message_frame
from palpate.core.control_loop import ARM, LoopObserver, UnfinishedTick
from palpate.core.errors import DeviceError, LogError, PalpateError
from palpate.core.ports import AppliedCommand, JointCommand, Snapshot
from palpate.core.trial import TrialReport

_BATCH: Final = 14
"""Messages handed over at once, a tenth of a second of ticks: one system call for all of them."""
_UNFIT: Final = (ValueError, TypeError, OverflowError, struct.error)
"""What packing raises for a value that the schema cannot hold, such as a number of more than 64 bits."""

_WholeTick: TypeAlias = tuple[int, Snapshot, JointCommand, AppliedCommand]
"""A tick that came to a command, not packed yet; the first is its deadline, ns."""
_NOTHING: Final = UnfinishedTick("", None, None, None, None)


class FlightRecorder(LoopObserver):
    """One log after the other, trial by trial. It packs and queues; the sink does the rest.

    Args:
        stop_on_trouble: A message that cannot be kept ends the trial instead of being counted.
    """

    def __init__(self, sink: Sink, *, stop_on_trouble: bool = False) -> None:
        self._sink, self._stop = sink, stop_on_trouble
        self.troubles: list[str] = []
        self.dropped_messages = 0
        self._recording = False
        self._clear()

    def _clear(self) -> None:
        self._tick, self._now_ns = -1, 0
        self._deadline_ns: int | None = None
        self._unfinished = _NOTHING
        self._report: TrialReport | None = None
        self._events = self._decisions = self._settled = 0
        self._batch: list[bytes | _WholeTick] = []
        self._batch_tick = -1
        self._lost: LossEntry | None = None
        self._lost_ns = 0
        self._start: Callable[[], StartRecord] | None = None
        self._counterfactual: Callable[[], bool] | None = None

    def begin(
        self,
        opening: Opening,
        start: Callable[[], StartRecord],
        counterfactual: Callable[[], bool] | None = None,
    ) -> None:
        """Open a log.

        Args:
            start: Gives what the trial started with; asked when the task has begun, or could not begin.
            counterfactual: For a what-if: whether the trial has left the recorded path, and messages are to say so.
        """
        if self._recording:
            raise LogError(str(opening.path), "", "the log before is still open", "end it first")
        self._clear()
        self._sink.open(opening)
        self._start, self._counterfactual = start, counterfactual
        self._recording = True

    def end(self, record: EndRecord | None) -> None:
        """Close the log with what the trial came to; with None it ends before the trial does."""
        if not self._recording:
            return
        self._put_start()
        # From here on nothing is handed over that the sink may refuse: closing takes all of it.
        self._recording = False
        if self._deadline_ns is not None:
            tick = self._unfinished
            self._keep_tick(TickRecord(self._tick, tick.time_ns, self._deadline_ns, tick.wrench, tick.joints))
        self._follow(final=True)
        if record is not None:
            self._keep(END, replace(record, counterfactual=self._off_path()))
        self._sink.close(b"".join(self._packed()))
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
            # Packed later, many at once: in the loop's gaps between physics every line of code runs on cold caches.
            if not self._batch:
                self._batch_tick = snapshot.tick
            self._batch.append((deadline_ns, snapshot, command, applied))
        else:
            parts = snapshot.wrench, snapshot.joints, command.position_rad, applied, self._off_path()
            self._keep_tick(TickRecord(snapshot.tick, snapshot.time_ns, deadline_ns, *parts))
        if len(report.events) != self._events or len(report.decisions) != self._decisions:
            self._follow()
        if len(self._batch) >= _BATCH:
            self._hand_over()
        # Without a writer nothing more is kept, whatever is to be done about smaller troubles.
        if self.troubles and (self._stop or self._sink.gone):
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
            self._hand_over(vital=True)

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
        try:
            frame = message_frame(kind.id, self._now_ns, encode_record(kind.message, record))
        except _UNFIT as error:
            self._refuse(kind, error, self._tick)
        else:
            if not self._batch:
                self._batch_tick = self._tick
            self._batch.append(frame)
        if self._recording and len(self._batch) >= _BATCH:
            self._hand_over()

    def _refuse(self, kind: ChannelKind, error: Exception, tick: int) -> None:
        """Recording does not end what it records: what cannot be packed is lost, and told."""
        if self._lost is None:
            self.troubles.append(f"a message on {kind.topic} at tick {tick} cannot be packed ({error})")
        self._lose(1, tick, tick, "cannot be packed")

    def _hand_over(self, *, vital: bool = False) -> None:
        first, frames = self._batch_tick, self._packed()
        if not frames:
            return
        taken, told = self._sink.put(b"".join(frames), vital=vital), self._ask_sink()
        if taken:
            self._lost = None
            return
        if self._lost is None and not told:
            self.troubles.append(f"the writer is behind and the queue is full: messages are lost from tick {first} on")
        # The mark itself was among them, if there was one.
        self._lose(len(frames) - (self._lost is not None), first, self._tick, "queue full")

    def _packed(self) -> list[bytes]:
        """The frames of the batch, which is empty then; a mark of what is lost before them, if anything is."""
        batch, self._batch = self._batch, []
        frames: list[bytes] = []
        for item in batch:
            if isinstance(item, bytes):
                frames.append(item)
                continue
            _, snapshot, command, applied = item
            try:
                asked, joints = command.position_rad, snapshot.joints.position_rad
                layout = full_layout(len(asked), len(joints), len(applied.position_rad), snapshot.wrench.frame)
                frames.append(message_frame(TICK.id, snapshot.time_ns, layout.pack(*item)))
            except _UNFIT as error:
                self._refuse(TICK, error, snapshot.tick)
        if self._lost is not None:
            # There is room again, or so it seems: first of all the log must tell what it lacks.
            frames.insert(0, message_frame(RECORDER.id, self._lost_ns, encode_record("Recorder", self._lost)))
        return frames

    def _lose(self, messages: int, first_tick: int, last_tick: int, problem: str) -> None:
        before = self._lost
        self.dropped_messages += messages
        self._lost_ns = self._now_ns
        if before is not None:
            messages += before.dropped_messages
            problem, first_tick = before.problem, before.first_dropped_tick or 0
        self._lost = LossEntry(
            tick=last_tick,
            problem=problem,
            text=f"{messages} messages are missing, from tick {first_tick} to {last_tick}",
            dropped_messages=messages,
            first_dropped_tick=first_tick,
            last_dropped_tick=last_tick,
        )

    def _ask_sink(self) -> bool:
        """Take over what it has to tell; whether that was anything."""
        told = len(self.troubles)
        while (trouble := self._sink.trouble()) is not None:
            self.troubles.append(trouble)
        return len(self.troubles) > told
