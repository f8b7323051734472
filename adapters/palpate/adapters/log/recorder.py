"""Trial recorder for the control loop's per-tick data and the task's reports."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

from typing_extensions import override

from palpate.adapters.log import records
from palpate.adapters.log.sink import LogMessage, Sink
from palpate.core.control_loop import ARM, LoopObserver, UnfinishedTick
from palpate.core.errors import DeviceError, PalpateError
from palpate.core.ports import AppliedCommand, JointCommand, Snapshot
from palpate.core.trial import TrialReport

_NOTHING: Final = UnfinishedTick("", None, None, None, None)


class FlightRecorder(LoopObserver):
    """Recorder that passes a trial's messages to a sink, which packs them.

    Args:
        start: Function that returns the start record; called after the task has begun or failed to begin.
        counterfactual: Function that returns True once a what-if has left the recorded path; messages are then marked.
        stop_on_loss: True to end the trial if a message cannot be stored; False to only report it.
    """

    def __init__(
        self,
        sink: Sink,
        start: Callable[[], records.StartRecord],
        counterfactual: Callable[[], bool] = lambda: False,
        *,
        stop_on_loss: bool = False,
    ) -> None:
        self._sink, self._off_path, self._stop = sink, counterfactual, stop_on_loss
        self._start: Callable[[], records.StartRecord] | None = start
        self._tick, self._now_ns = -1, 0
        self._deadline_ns: int | None = None
        self._unfinished = _NOTHING
        self._report: TrialReport | None = None
        self._events = self._decisions = self._settled = 0
        self._sequence = 0

    @property
    def failed_port(self) -> str:
        """Return the port whose call ended the trial, or an empty string if no port call failed."""
        return self._unfinished.calling

    def end(self, record: records.EndRecord | None) -> None:
        """Record the outcome, or None if the log ends before the trial."""
        self._put_start()
        if self._deadline_ns is not None:
            tick = self._unfinished
            self._keep(records.TickRecord(self._tick, tick.time_ns, self._deadline_ns, tick.wrench, tick.joints))
        self._follow(final=True)
        if record is not None:
            self._mark(record)

    @override
    def begun(self, start_ns: int, report: TrialReport) -> None:
        self._now_ns, self._report = start_ns, report
        self._call(records.CallEntry(tick=self._tick, port="clock", call="now_ns", time_ns=start_ns))

    @override
    def waited(self, tick: int, deadline_ns: int) -> None:
        self._tick, self._deadline_ns = tick, deadline_ns

    @override
    def sent(self, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> None:
        report = self._report
        self._now_ns, deadline_ns, self._deadline_ns = snapshot.time_ns, self._deadline_ns, None
        if self._sink.takes_ticks:
            # Converted to a record later by the sink: between two ticks of a loop all code runs on cold caches.
            self._keep((deadline_ns, snapshot, command, applied, self._off_path()))
        if report is not None and (len(report.events) != self._events or len(report.decisions) != self._decisions):
            self._follow()
        if self._stop and self._sink.losses:
            raise DeviceError("flight recorder", self._sink.losses[-1])

    @override
    def failed(self, error: BaseException, tick: UnfinishedTick) -> None:
        self._unfinished = tick
        if tick.time_ns is not None:
            self._now_ns = tick.time_ns
        if tick.calling and isinstance(error, PalpateError):
            call = records.CallEntry(
                tick=self._tick,
                port=tick.calling,
                call="send" if tick.calling == ARM else "read",
                requested_rad=None if tick.command is None else tick.command.position_rad,
            )
            self._call(replace(call, error=type(error).__name__, text=str(error)))

    @override
    def stopped(self, error: BaseException | None) -> None:
        stop = records.CallEntry(tick=self._tick, port=ARM, call="stop")
        if error is None:
            self._call(stop)
        elif isinstance(error, PalpateError):
            self._call(replace(stop, error=type(error).__name__, text=str(error)))

    # Inside.

    def _call(self, entry: records.CallEntry) -> None:
        """Record a port call that is not one of the four calls in a tick: a failed call, or a call outside the loop."""
        self._put_start()
        self._keep(entry)

    def _put_start(self) -> None:
        """Record the start before all other messages, once the task has begun or failed to begin."""
        if self._start is not None:
            start, self._start = self._start, None
            self._keep(start())

    def _follow(self, *, final: bool = False) -> None:
        """Record new entries in the task's report and, at the end, the reinforcement for the last decision."""
        report = self._report
        if report is None:
            return
        for event in report.events[self._events :]:
            self._mark(records.EventEntry(tick=event.tick, name=event.name, detail=event.detail))
        self._events = len(report.events)
        if not final and len(report.decisions) == self._decisions:
            return
        for number, decision in enumerate(report.decisions[self._settled :], start=self._settled):
            if number >= self._decisions:
                self._mark(records.DecisionEntry.of(number, decision, report.temperature))
            if decision.reinforcement is not None:
                self._mark(
                    records.ReinforcementEntry(tick=self._tick, number=number, reinforcement=decision.reinforcement)
                )
                self._settled = number + 1
        self._decisions = len(report.decisions)

    def _mark(self, record: Any) -> None:
        """Store a record, marked if it is counterfactual."""
        self._keep(replace(record, counterfactual=True) if self._off_path() else record)

    def _keep(self, record: object) -> None:
        self._sink.put(LogMessage(record, self._now_ns, self._sequence, self._tick))
        self._sequence += 1
