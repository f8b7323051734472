"""Clauses that hold for both sensor ports: time stamps, sequence numbers, silence."""

from abc import abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from random import Random
from typing import Any, TypeVar

from typing_extensions import override

from palpate.core.errors import DeviceError
from palpate.core.ports.contracts.device import DeviceContract, activate
from palpate.core.ports.contracts.lives import pass_time, replug
from palpate.core.ports.contracts.rigs import SensorRig
from palpate.core.ports.contracts.violations import ClauseNotApplicable, knob, require
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import JointSample, Validity, WrenchSample

SensorRigT = TypeVar("SensorRigT", bound=SensorRig[Any])

_LONG_SILENCE_TICKS = 30
_SEED = 22
_UNREAD_TURNS, _UNREAD_TICKS = 40, 30
"""So often nobody reads for so long."""


class SampleContract(DeviceContract[SensorRigT]):
    """Clauses on samples, whatever they measure."""

    _told: dict[object, Any]
    _last: Any = None
    _worlds: Random
    _world: int = 0

    @override
    @contextmanager
    def _rig(self, life: Life) -> Iterator[SensorRigT]:
        """Besides: nothing is held against the samples of another rig."""
        self._told, self._last, self._worlds = {}, None, Random(_SEED)
        with super()._rig(life) as rig:
            yield rig

    @override
    def use(self, rig: SensorRigT) -> object:
        return self._read(rig)

    @override
    def works(self, rig: SensorRigT) -> None:
        """A sample is newer than any before it, and of one of three worlds it says the same as each time."""
        # All of them at first, then another than before.
        for world in ((self._world + self._worlds.choice((1, 2))) % 3,) if self._told else range(3):
            self._look_at(rig, world)

    def _look_at(self, rig: SensorRigT, number: int) -> None:
        self._world, world = number, self._change(rig, number)
        rig.advance(rig.settle_ticks)
        sample = self._read(rig)
        if self._last is not None:
            newer = sample.sequence > self._last.sequence and sample.source_time_ns > self._last.source_time_ns
            require("order of samples", newer, f"{_stamp(sample)} after {_stamp(self._last)}", "no way back")
        self._require_young(rig, sample)
        self._last, first = sample, self._told.setdefault(world, sample)
        found = self._differs(rig, first, sample)
        require("as before", not found, found, "the same of the same world, at any time")

    @abstractmethod
    def _differs(self, rig: SensorRigT, one: Any, other: Any) -> str:
        """In what two samples of the same world are not the same; empty where they are."""

    @abstractmethod
    def _unsound(self, rig: SensorRigT, sample: Any) -> str:
        """What is wrong with the type, the frame or the numbers of any sample; empty if nothing."""

    @abstractmethod
    def _change(self, rig: SensorRigT, world: int) -> object:
        """Make the world one of three; gives which it now is, or None where nothing can be changed."""

    def _read(self, rig: SensorRigT) -> WrenchSample | JointSample:
        sample: WrenchSample | JointSample = rig.device.read()
        return sample

    def test_every_sample_is_sound(self) -> None:
        """Over a long run each sample is of its type, finite, in time and order, young and new, and tells what is."""
        with self._rig(Life.ACTIVE) as rig:
            last, late, missed, told = self._read(rig), 0, 0, dict[object, Any]()
            self._require_sound(rig, last)
            age_ns, worlds = rig.clock.now_ns() - last.source_time_ns, Random(_SEED)
            for turn in range(max(1, rig.long_ticks // rig.settle_ticks)):
                if turn % _UNREAD_TURNS == _UNREAD_TURNS - 1:
                    rig.advance(_UNREAD_TICKS)
                world = self._change(rig, worlds.randrange(3))
                for _ in range(rig.settle_ticks):
                    rig.advance(1)
                    before_ns = rig.clock.now_ns()
                    sample = self._read(rig)
                    late += rig.clock.now_ns() - before_ns > rig.call_budget_ns
                    self._require_sound(rig, sample)
                    observed = f"{_stamp(sample)} after {_stamp(last)}"
                    newer = sample.sequence > last.sequence and sample.source_time_ns > last.source_time_ns
                    require("order of samples", newer or sample == last, observed, "a new number for a new sample")
                    missed, last = missed + (not newer), sample
                found = self._differs(rig, told.setdefault(world, sample), sample)
                require("as before", not found, found, f"the same of the same world, at tick {turn * rig.settle_ticks}")
                # A live device may miss a tick now and then, and a computer be late.
                allowed = 1 + turn * rig.settle_ticks // 50 if rig.runs_by_itself else 0
                require("news", missed <= allowed, f"{observed}, {missed} times so", "a new sample each tick")
                require("time of a call", late <= allowed, f"{late} too long", f"{rig.call_budget_ns} ns at most")
            grown_ns = rig.clock.now_ns() - last.source_time_ns - age_ns
            require("age", grown_ns <= rig.max_age_ns, f"{grown_ns} ns more", f"at most {rig.max_age_ns} ns more")

    def _require_sound(self, rig: SensorRigT, sample: Any) -> None:
        for name in ("source_time_ns", "receive_time_ns", "sequence"):
            value = getattr(sample, name, None)
            whole = isinstance(value, int) and not isinstance(value, bool)
            require("stamps", whole, f"{name} = {value!r}", "an int")
        source_ns, receive_ns, now_ns = sample.source_time_ns, sample.receive_time_ns, rig.clock.now_ns()
        observed = f"source {source_ns}, receive {receive_ns}, now {now_ns} ns"
        require("times", source_ns <= receive_ns <= now_ns, observed, "source <= receive <= now")
        self._require_young(rig, sample)
        wrong = self._unsound(rig, sample)
        require("sample", not wrong, wrong, "what its port's values say")

    @staticmethod
    def _require_young(rig: SensorRigT, sample: Any) -> None:
        age_ns = rig.clock.now_ns() - sample.source_time_ns
        young = sample.validity in (Validity.VALID, Validity.SATURATED) and age_ns <= rig.max_age_ns
        observed = f"a sample, {sample.validity}, {age_ns} ns old"
        require("age", young, observed, f"VALID or SATURATED, at most {rig.max_age_ns} ns old")

    def test_reading_twice_gives_the_same_sample(self) -> None:
        """Without news, a second reading gives the same sample under the same number."""
        with self._rig(Life.ACTIVE) as rig:
            for _ in range(5):
                first, second = self._read(rig), self._read(rig)
                # Where the world goes on by itself, there may be news in between; then it is younger, too.
                news = rig.runs_by_itself and second.sequence > first.sequence
                news = news and second.source_time_ns > first.source_time_ns
                require("no news", news or first == second, f"{second} after {first}", "the same sample again")
                rig.advance(1)

    def test_silence_is_not_passed_off_as_news(self) -> None:
        """Once the newest sample is over age, reading raises DeviceError or gives it marked STALE, at once."""
        with self._rig(Life.ACTIVE) as rig:
            go_silent = knob(rig.go_silent, "go_silent")
            replug(rig)
            last = self._read(rig)
            go_silent()
            pass_time(rig, rig.max_age_ns)
            stale = self._require_silent(rig, None)
            if stale is not None and stale.sequence == last.sequence:
                same = replace(stale, validity=last.validity) == last
                require("silence", same, f"{stale} after {last}", "the same sample but for its validity")
            for _ in range(_LONG_SILENCE_TICKS):
                stale = self._require_silent(rig, stale)
            rig.advance(rig.rest_ticks)
            self._require_silent(rig, stale)
            self._check_quick("silence", rig)
            if rig.device.life is Life.ACTIVE:
                rig.device.deactivate()
                with suppress(DeviceError):
                    rig.device.activate()
                    pass_time(rig, rig.max_age_ns)
                    self._require_silent(rig, None)
        with self._rig(Life.CONSTRUCTED) as rig:
            knob(rig.go_silent, "go_silent")()
            with suppress(DeviceError):
                rig.device.configure()
                rig.device.activate()
                pass_time(rig, rig.max_age_ns)
                self._require_silent(rig, None)

    def _require_silent(self, rig: SensorRigT, stale: Any) -> Any:
        """What is read of a silent device is marked, and the same each time."""
        try:
            sample = self._read(rig)
        except DeviceError:
            return stale
        finally:
            rig.advance(1)
        marked = sample.validity in (Validity.STALE, Validity.INVALID)
        observed = f"a {sample.validity.value} sample ({_stamp(sample)})"
        require("silence", marked, observed, f"STALE or DeviceError after {rig.max_age_ns} ns")
        require("silence", sample == (stale or sample), f"{sample} after {stale}", "the same sample, while none is new")
        return sample


def pause(rig: SensorRig[Any]) -> int:
    """Deactivate a sensor for as long as a sample counts, let it have a fault, unplug it, and activate it again.

    Returns:
        When it was activated again, in ns.
    """
    rig.device.deactivate()
    pass_time(rig, rig.max_age_ns)
    if rig.provoke_fault is not None:
        rig.device.activate()
        rig.advance(1)
        rig.provoke_fault()
        rig.device.acknowledge_fault()
    activate(rig.device)
    replug(rig)
    now_ns = rig.clock.now_ns()
    pass_time(rig, 2 * rig.max_age_ns)
    return now_ns


def standing_world(rig: SensorRig[Any]) -> None:
    """Refuse a clause that needs a world which waits between two calls.

    Raises:
        ClauseNotApplicable: This world goes on by itself.
    """
    if rig.runs_by_itself:
        raise ClauseNotApplicable("this rig's world does not wait between two calls")


def _stamp(sample: WrenchSample | JointSample) -> str:
    return f"sequence {sample.sequence} at {sample.source_time_ns} ns"
