"""Turns what passes the ports, and what the core reports, into the messages of a log."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import replace
from typing import Final, TypeAlias

from palpate.adapters.log.follower import HasReport, ReportFollower
from palpate.adapters.log.records import CallEntry, EndRecord, LossEntry, StartRecord, encode_call, encode_record
from palpate.adapters.log.schema import CALL, END, RECORDER, START, TICK, ChannelKind
from palpate.adapters.log.tick_layout import TickRecord, encode_tick, full_layout
from palpate.adapters.log.writer_client import Opening, Sink
from palpate.adapters.log.writer_process import message_frame
from palpate.core.errors import DeviceError, LogError
from palpate.core.ports.values import AppliedCommand, JointCommand, JointSample, WrenchSample

_BATCH: Final = 14
"""Messages handed over at once, a tenth of a second of ticks: one system call for all of them."""
_UNFIT: Final = (ValueError, TypeError, OverflowError, struct.error)
"""What packing raises for a value that the schema cannot hold, such as a number of more than 64 bits."""


_WholeTick: TypeAlias = tuple[int, int, int, WrenchSample, JointSample, JointCommand, AppliedCommand]
"""Tick, time, deadline, and what passed the ports: a tick in which everything happened, not packed yet."""


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
        self._clear()

    def _clear(self) -> None:
        self._tick, self._now_ns, self._deadline_ns = -1, 0, 0
        self._open_tick = False
        self._time_ns: int | None = None
        self._wrench: WrenchSample | None = None
        self._joints: JointSample | None = None
        self._asked: JointCommand | None = None
        self._applied: AppliedCommand | None = None
        self._follower: ReportFollower | None = None
        self._batch: list[bytes | _WholeTick] = []
        self._batch_tick = -1
        self._lost: LossEntry | None = None
        self._lost_ns = 0
        self._start: Callable[[], StartRecord] | None = None
        self._counterfactual: Callable[[], bool] | None = None

    @property
    def recording(self) -> bool:
        """Whether a log is open."""
        return self._recording

    def begin(
        self,
        opening: Opening,
        task: HasReport,
        start: Callable[[], StartRecord],
        counterfactual: Callable[[], bool] | None = None,
    ) -> None:
        """Open a log.

        Args:
            opening: Which file.
            task: Its report is read as the trial goes on.
            start: Gives what the trial started with; asked at the first port call, when the task has begun.
            counterfactual: For a what-if: whether the trial has left the recorded path, and messages are to say so.

        Raises:
            LogError: One is open already.
        """
        if self._recording:
            raise LogError(str(opening.path), "", "the log before is still open", "end it first")
        self._clear()
        self._sink.open(opening)
        self._follower, self._start, self._counterfactual = ReportFollower(task), start, counterfactual
        self._recording = True

    def end(self, record: EndRecord | None) -> None:
        """Close the log with what the trial came to; with None it ends before the trial does."""
        if not self._recording:
            return
        self._begun()
        # From here on nothing is handed over that the sink may refuse: closing takes all of it.
        self._recording = False
        self._finish_tick()
        self._follow(final=True)
        if record is not None:
            self._keep(END, encode_record, END.message, replace(record, counterfactual=self._off_path()))
        self._sink.close(b"".join(self._packed()))
        self._ask_sink()

    @property
    def tick(self) -> int:
        """The tick that is under way; -1 before the first."""
        return self._tick

    # What the decorated ports tell. Each port's first word in a tick goes into the tick's message.

    def slept(self, deadline_ns: int) -> None:
        """The loop begins a tick: it slept until then."""
        if self._recording:
            if self._start is not None:
                self._begun()
            if self._open_tick:
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
        elif wrench is None or joints is None or time_ns is None or self._counterfactual is not None:
            self._asked, self._applied = command, applied
            self._finish_tick()
        else:
            # Packed later, many at once: in the loop's gaps between physics every line of code runs on cold caches.
            if not self._batch:
                self._batch_tick = self._tick
            self._batch.append((self._tick, time_ns, self._deadline_ns, wrench, joints, command, applied))
            self._open_tick = False
            self._wrench = self._joints = self._time_ns = None
        if self._follower is not None and self._follower.has_news:
            self._follow()
        if len(self._batch) >= _BATCH:
            self._hand_over()
        if self._stop and self.troubles:
            raise DeviceError("flight recorder", self.troubles[-1])

    def call(self, entry: CallEntry) -> None:
        """A port call that no tick message holds."""
        if self._recording:
            self._begun()
            self._keep(CALL, encode_call, entry)

    # Inside.

    def _begun(self) -> None:
        """At the first word from any port: the task has begun, and what the trial starts with is known."""
        if self._start is not None:
            start, self._start = self._start, None
            self._keep(START, encode_record, START.message, start())
            self._hand_over(vital=True)

    def _finish_tick(self) -> None:
        """Keep a tick in which not everything happened."""
        if self._open_tick:
            self._open_tick = False
            asked = None if self._asked is None else self._asked.position_rad
            record = TickRecord(
                self._tick, self._time_ns, self._deadline_ns, self._wrench, self._joints, asked, self._applied,
                self._off_path(),
            )  # fmt: skip
            self._keep(TICK, encode_tick, record)
            self._time_ns = self._wrench = self._joints = self._asked = self._applied = None

    def _off_path(self) -> bool:
        return self._counterfactual is not None and self._counterfactual()

    def _follow(self, *, final: bool = False) -> None:
        """Take over what the task has newly reported."""
        if self._follower is not None:
            for kind, record in self._follower.news(self._tick, final=final, counterfactual=self._off_path()):
                self._keep(kind, encode_record, kind.message, record)

    def _keep(self, kind: ChannelKind, encode: Callable[..., bytes], *record: object) -> None:
        try:
            self._message(kind.id, encode(*record))
        except _UNFIT as error:
            self._refuse(kind, error, self._tick)
        if self._recording and len(self._batch) >= _BATCH:
            self._hand_over()

    def _message(self, channel: int, payload: bytes) -> None:
        if not self._batch:
            self._batch_tick = self._tick
        self._batch.append(message_frame(channel, self._now_ns, payload))

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
            tick, time_ns, deadline_ns, wrench, joints, command, applied = item
            asked_rad, applied_rad = command.position_rad, applied.position_rad
            try:
                layout = full_layout(len(asked_rad), len(joints.position_rad), len(applied_rad), wrench.frame)
                payload = layout.pack(
                    tick, time_ns, deadline_ns, wrench, joints, asked_rad, applied_rad, applied.reason
                )
                frames.append(message_frame(TICK.id, time_ns, payload))
            except _UNFIT as error:
                self._refuse(TICK, error, tick)
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
