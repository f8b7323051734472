"""A recorded trial, port by port: what each call gave, and how what the core put out is held against it."""

from collections import defaultdict, deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import zip_longest
from typing import Final, Generic, NamedTuple, TypeVar

from palpate.adapters.log import CallEntry, TickRecord, TrialLog
from palpate.adapters.replay.differences import Differences, same_bits
from palpate.core import errors
from palpate.core.errors import LogError, PalpateError
from palpate.core.ports import (
    SENSOR_FRAME,
    AppliedCommand,
    CommandReason,
    JointSample,
    JointVector,
    WrenchKind,
    WrenchSample,
)

SLEEP: Final = "clock.sleep_until"
NOW: Final = "clock.now_ns"
FORCE: Final = "force_sensor.read"
JOINTS: Final = "joint_encoder.read"
SEND: Final = "arm.send"
STOP: Final = "arm.stop"
_KNOWN: Final = frozenset({SLEEP, NOW, FORCE, JOINTS, SEND, STOP})


class CallOrder:
    """All port calls of a trial in their order, those of its log and those that the core makes now: ``port.call``.

    Attributes:
        told: Those of the log.
        made: What the core has called, once it was answered.
    """

    def __init__(self) -> None:
        self.told: list[str] = []
        self.made: list[str] = []

    def tell_call(self, call: CallEntry) -> None:
        """Add a call that is none of a tick's own; other entries, such as of an injected fault, are none."""
        name = f"{call.port}.{call.call}"
        if name in _KNOWN:
            self.told.append(name)

    def first_difference(self, *, whole: bool) -> tuple[int, str, str] | None:
        """Where the lists part.

        Args:
            whole: The log goes to the trial's end; else the core may call more than it tells.

        Returns:
            Tick, recorded call and replayed call, where nothing stands for no call; None if they are equal.
        """
        tick = -1
        for told, made in zip_longest(self.told, self.made, fillvalue=""):
            if told == SLEEP:
                tick += 1
            if told != made and (told or whole):
                return tick, told, made
        return None


T = TypeVar("T")


class TapeEndError(PalpateError):
    """The core asked for more than was recorded."""

    def __init__(self, port: str) -> None:
        self.port = port
        super().__init__(f"the recording of {port} ends here")


@dataclass(frozen=True, slots=True)
class Raised:
    """A port call that failed.

    Attributes:
        kind: Name of the error's class.
    """

    kind: str
    text: str

    def again(self) -> PalpateError:
        """The error, made anew."""
        kind = getattr(errors, self.kind, PalpateError)
        made: PalpateError = kind.__new__(kind)
        Exception.__init__(made, self.text)
        return made


class Sent(NamedTuple):
    """A command as recorded."""

    tick: int
    asked_rad: JointVector
    applied: AppliedCommand


class Track(Generic[T]):
    """What one port gave, call by call."""

    def __init__(self, call: str, load: Callable[[], bool], order: CallOrder) -> None:
        self._call, self._load = call, load
        self._told, self._made = order.told.append, order.made.append
        self._items: deque[T | Raised] = deque()
        self.append = self._items.append

    def tell(self, item: T) -> None:
        """Add what a call of a tick gave."""
        self._items.append(item)
        self._told(self._call)

    def next(self) -> T:
        """The next one; what failed fails again.

        Raises:
            TapeEndError: There is no more.
        """
        items = self._items
        while not items:
            if not self._load():
                raise TapeEndError(self._call.partition(".")[0])
        item = items.popleft()
        self._made(self._call)
        if isinstance(item, Raised):
            raise item.again()
        return item

    @property
    def left(self) -> bool:
        """Whether there is more."""
        while not self._items:
            if not self._load():
                return False
        return True

    def refused(self) -> None:
        """The call is refused here, as it was when it was recorded: pass over that refusal."""
        if self.left and isinstance(self._items[0], Raised):
            self._items.popleft()
            self._made(self._call)

    @property
    def waiting(self) -> bool:
        """Whether there is more in what is loaded already."""
        return bool(self._items)


class Tape:
    """A recorded trial, port by port; ticks are decoded as they are needed.

    Attributes:
        tick: The tick that is under way in the replay; -1 before the first.
        odd_tick: The first tick whose wrench is none of the sensor's own frame, or not as it was measured.
        claimed_tick: The first tick that calls itself a what-if's.
    """

    def __init__(self, log: TrialLog) -> None:
        self.log = log
        self.tick = -1
        self.differences = Differences()
        self.at_tick: Callable[[int], None] | None = None
        self.order = CallOrder()
        self.last: TickRecord | None = None
        self.odd_tick: int | None = None
        self.claimed_tick: int | None = None
        self.clock: Track[int] = Track(NOW, self._load, self.order)
        self.deadlines: Track[int] = Track(SLEEP, self._load, self.order)
        self.wrenches: Track[WrenchSample] = Track(FORCE, self._load, self.order)
        self.joints: Track[JointSample] = Track(JOINTS, self._load, self.order)
        self.sends: Track[Sent] = Track(SEND, self._load, self.order)
        self.stops: Track[None] = Track(STOP, self._load, self.order)
        self._calls: dict[int, list[CallEntry]] = defaultdict(list)
        for call in log.calls:
            self._calls[call.tick].append(call)
        self._records = log.records()
        self._loaded = 0
        self._add_calls(self._calls.get(-1, ()))

    def _load(self) -> bool:
        """Bring what the next tick holds; False when there is none."""
        record = next(self._records, None)
        if record is None:
            return False
        tick = record.tick
        if tick != self._loaded:
            self._refuse_gap(self._loaded, tick)
        self._loaded += 1
        self.last = record
        if record.counterfactual and self.claimed_tick is None:
            self.claimed_tick = tick
        # In the order in which a loop makes these calls.
        if record.deadline_ns is not None:
            self.deadlines.tell(record.deadline_ns)
        if record.time_ns is not None:
            self.clock.tell(record.time_ns)
        if record.wrench is not None:
            self.wrenches.tell(record.wrench)
            if self.odd_tick is None and not _as_measured(record.wrench):
                self.odd_tick = tick
        if record.joints is not None:
            self.joints.tell(record.joints)
        if record.asked_rad is not None and record.applied is not None:
            self.sends.tell(Sent(tick, record.asked_rad, record.applied))
        if tick in self._calls:
            self._add_calls(self._calls[tick])
        return True

    def _refuse_gap(self, expected: int, tick: int) -> None:
        if expected == 0:
            where, problem = f"tick {tick}", f"the first {tick} ticks are missing"
        else:
            where, problem = f"tick {expected}", f"ticks {expected} to {tick - 1} are missing"
        lost = "; ".join(f"{loss.problem}: {loss.text}" for loss in self.log.losses)
        remedy = "a trial can only be replayed whole" + (f" (the recorder noted: {lost})" if lost else "")
        raise LogError(self.log.path, where, problem, remedy)

    def _add_calls(self, calls: Iterable[CallEntry]) -> None:
        for call in calls:
            self.order.tell_call(call)
            if call.call == "now_ns" and call.time_ns is not None:
                self.clock.append(call.time_ns)
            elif call.call == "read" and call.port == "force_sensor":
                self.wrenches.append(Raised(call.error, call.text) if call.wrench is None else call.wrench)
            elif call.call == "read" and call.port == "joint_encoder":
                self.joints.append(Raised(call.error, call.text) if call.joints is None else call.joints)
            elif call.call == "send":
                if call.asked_rad is None or call.applied is None:
                    self.sends.append(Raised(call.error, call.text))
                else:
                    self.sends.append(Sent(call.tick, call.asked_rad, call.applied))
            elif call.call == "stop":
                self.stops.append(Raised(call.error, call.text) if call.error else None)

    def load_rest(self) -> None:
        """Bring all ticks that are left."""
        while self._load():
            pass

    def check_command(self, sent: Sent, asked_rad: JointVector) -> None:
        """Hold a command against the recorded one."""
        recorded = sent.asked_rad
        # Most are equal, and this is the cheapest exact way to see it: only zeros have two bit patterns.
        if asked_rad != recorded or (0.0 in asked_rad and not same_bits(asked_rad, recorded)):
            self._command_differs(sent.tick, "asked_rad", recorded, asked_rad)
        applied = sent.applied
        if applied.reason is CommandReason.AS_ASKED and (
            applied.position_rad != recorded or (0.0 in recorded and not same_bits(applied.position_rad, recorded))
        ):
            # The log contradicts itself: a command that was applied as asked is the command that was asked for.
            self._command_differs(sent.tick, "applied_rad", applied.position_rad, recorded)

    def _command_differs(self, tick: int, field: str, recorded: JointVector, replayed: JointVector) -> None:
        if self.differences.first_command_tick is None:
            self.differences.first_command_tick = tick
        self.differences.compare(tick, "/tick", field, recorded, replayed)

    def check_deadline(self, deadline_ns: int) -> None:
        """Hold the end of a sleep against the recorded one."""
        recorded = self.deadlines.next()
        if recorded != deadline_ns:
            self.differences.add(self.tick, "/tick", "deadline_ns", recorded, deadline_ns)


def _as_measured(wrench: WrenchSample) -> bool:
    return wrench.kind is WrenchKind.RAW and wrench.frame == SENSOR_FRAME
