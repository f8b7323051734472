"""A recorded trial as one tape per port, with the result of each call and the commands to compare."""

from collections import defaultdict, deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from palpate.adapters.log import CallEntry, TickRecord, TrialLog
from palpate.adapters.replay.differences import Differences, same_bits
from palpate.core import errors
from palpate.core.errors import LogError, PalpateError
from palpate.core.ports import AppliedCommand, CommandReason, JointSample, JointVector, WrenchSample

T = TypeVar("T")


class TapeEndError(Exception):
    """The core requests more than was recorded. This is not a palpate error, because nothing in the trial failed."""

    def __init__(self, port: str) -> None:
        super().__init__(f"the recording of {port} ends here")


@dataclass(frozen=True, slots=True)
class Raised:
    """A failed port call, with the class name of its error."""

    kind: str
    text: str

    def again(self) -> PalpateError:
        """Return the same error."""
        kind = getattr(errors, self.kind, PalpateError)
        made: PalpateError = kind.__new__(kind)
        Exception.__init__(made, self.text)
        return made


class Track(Generic[T]):
    """Recorded results from one port, in call order."""

    def __init__(self, port: str, load: Callable[[], bool]) -> None:
        self._port, self._load = port, load
        self._items: deque[T | Raised] = deque()
        self.append = self._items.append

    def next(self) -> T:
        """Return the next result, or raise the recorded error again.

        Raises:
            TapeEndError: The recording has ended.
        """
        if not self._items and not self.left:
            raise TapeEndError(self._port)
        item = self._items.popleft()
        if isinstance(item, Raised):
            raise item.again()
        return item

    @property
    def left(self) -> bool:
        """True if any results are left."""
        while not self._items and self._load():
            pass
        return bool(self._items)

    def pass_refused(self) -> None:
        """Skip the recorded error for a call that the replay also rejects."""
        if self.left and isinstance(self._items[0], Raised):
            self._items.popleft()


class Tape:
    """A recorded trial with one tape per port, its current tick (-1 before the first), and the last loaded tick."""

    def __init__(self, log: TrialLog) -> None:
        self.log = log
        self.tick = -1
        self.differences = Differences()
        self.last: TickRecord | None = None
        self.clock: Track[int] = Track("clock", self._load)
        self.deadlines: Track[int] = Track("clock", self._load)
        self.wrenches: Track[WrenchSample] = Track("force_sensor", self._load)
        self.joints: Track[JointSample] = Track("joint_encoder", self._load)
        self.sends: Track[tuple[JointVector, AppliedCommand]] = Track("arm", self._load)
        self.stops: Track[None] = Track("arm", lambda: False)
        self._calls: dict[int, list[CallEntry]] = defaultdict(list)
        for call in log.calls:
            self._calls[call.tick].append(call)
        # Decoded at once: between two ticks of a loop all code runs on cold caches.
        self._records = iter(list(log.records()))
        self._add_calls(-1)

    def _load(self) -> bool:
        """Load the next tick and return True; return False if there is none."""
        record = next(self._records, None)
        if record is None:
            return False
        expected = 0 if self.last is None else self.last.tick + 1
        if record.tick != expected:
            problem = f"ticks {expected} to {record.tick - 1} are missing"
            lost = "; ".join(f"{loss.problem}: {loss.text}" for loss in self.log.losses)
            remedy = "a trial can only be replayed whole" + (f" (the recorder noted: {lost})" if lost else "")
            raise LogError(self.log.path, f"tick {expected}", problem, remedy)
        self.last = record
        if record.counterfactual and not self.log.start.derived_from:
            self.differences.add(record.tick, "/tick", "counterfactual", True, False)
        if record.deadline_ns is not None:
            self.deadlines.append(record.deadline_ns)
        if record.time_ns is not None:
            self.clock.append(record.time_ns)
        if record.wrench is not None:
            self.wrenches.append(record.wrench)
        if record.joints is not None:
            self.joints.append(record.joints)
        if record.requested_rad is not None and record.applied is not None:
            self.sends.append((record.requested_rad, record.applied))
        self._add_calls(record.tick)
        return True

    def _add_calls(self, tick: int) -> None:
        for call in self._calls.get(tick, ()):
            failed = Raised(call.error, call.text)
            if call.call == "now_ns" and call.time_ns is not None:
                self.clock.append(call.time_ns)
            elif call.call == "read":
                (self.wrenches if call.port == "force_sensor" else self.joints).append(failed)
            elif call.call == "send":
                self.sends.append(failed)
            elif call.call == "stop":
                self.stops.append(failed if call.error else None)

    def next_answer(self, requested_rad: JointVector) -> AppliedCommand:
        """Compare a command with the recorded one and return the recorded applied command."""
        recorded, applied = self.sends.next()
        if not same_bits(requested_rad, recorded):
            self._command_differs("requested_rad", recorded, requested_rad)
        elif applied.reason is CommandReason.AS_REQUESTED and not same_bits(applied.position_rad, requested_rad):
            self._command_differs("applied_rad", applied.position_rad, requested_rad)
        return applied

    def _command_differs(self, field: str, recorded: JointVector, replayed: JointVector) -> None:
        if self.differences.first_command_tick is None:
            self.differences.first_command_tick = self.tick
        self.differences.compare(self.tick, "/tick", field, recorded, replayed)

    def check_deadline(self, deadline_ns: int) -> None:
        """Compare a sleep deadline with the recorded one."""
        self.differences.compare(self.tick, "/tick", "deadline_ns", self.deadlines.next(), deadline_ns)
