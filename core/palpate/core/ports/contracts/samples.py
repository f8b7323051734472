"""Clauses that hold for both sensor ports: time stamps, sequence numbers, silence."""

from __future__ import annotations

from typing import Any, TypeVar

from palpate.core.errors import DeviceError
from palpate.core.ports.contracts.device import LONG_TICKS, DeviceContract, activate, pass_time
from palpate.core.ports.contracts.rigs import SensorRig
from palpate.core.ports.contracts.violations import ClauseNotApplicable, knob, require
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import JointSample, Validity, WrenchSample

SensorRigT = TypeVar("SensorRigT", bound=SensorRig[Any])

_LONG_SILENCE_TICKS = 30


class SampleContract(DeviceContract[SensorRigT]):
    """Clauses on samples, whatever they measure."""

    def _use(self, rig: SensorRigT) -> object:
        return self._read(rig)

    def _read(self, rig: SensorRigT) -> WrenchSample | JointSample:
        sample: WrenchSample | JointSample = rig.device.read()
        return sample

    def test_stamps_are_integers(self) -> None:
        """Source time, receive time and sequence number are integers; validity is a Validity."""
        with self._rig(Life.ACTIVE) as rig:
            sample = self._read(rig)
            for name in ("source_time_ns", "receive_time_ns", "sequence"):
                value = getattr(sample, name)
                whole = isinstance(value, int) and not isinstance(value, bool)
                require("stamps", whole, f"{name} = {value!r}", "an int")
            require("stamps", isinstance(sample.validity, Validity), f"{sample.validity!r}", "a Validity")

    def test_times_are_in_order(self) -> None:
        """A sample is measured, then received, then read: source <= receive <= now."""
        with self._rig(Life.ACTIVE) as rig:
            for _ in range(10):
                sample = self._read(rig)
                source_ns, receive_ns, now_ns = (
                    sample.source_time_ns,
                    sample.receive_time_ns,
                    rig.clock.now_ns(),
                )
                observed = f"source {source_ns}, receive {receive_ns}, now {now_ns} ns"
                require("times", source_ns <= receive_ns <= now_ns, observed, "source <= receive <= now")
                rig.advance(1)

    def test_valid_sample_is_young(self) -> None:
        """While the device delivers, samples are VALID or SATURATED and no older than the greatest age."""
        with self._rig(Life.ACTIVE) as rig:
            for _ in range(10):
                sample = self._read(rig)
                age_ns = rig.clock.now_ns() - sample.source_time_ns
                usable = sample.validity in (Validity.VALID, Validity.SATURATED)
                observed = f"a {sample.validity.value} sample, {age_ns} ns old"
                require("age", usable and age_ns <= rig.max_age_ns, observed, f"at most {rig.max_age_ns} ns")
                rig.advance(1)

    def test_sequence_and_time_never_go_back(self) -> None:
        """Over many ticks, neither sequence number nor source time ever goes back, or falls behind."""
        with self._rig(Life.ACTIVE) as rig:
            last = self._read(rig)
            age_ns = rig.clock.now_ns() - last.source_time_ns
            for _ in range(LONG_TICKS):
                rig.advance(1)
                new = self._read(rig)
                forward = new.sequence >= last.sequence and new.source_time_ns >= last.source_time_ns
                require("order of samples", forward, f"{_stamp(new)} after {_stamp(last)}", "no way back")
                last = new
            grown_ns = rig.clock.now_ns() - last.source_time_ns - age_ns
            require("age", grown_ns <= rig.max_age_ns, f"{grown_ns} ns more", f"at most {rig.max_age_ns} ns more")

    def test_world_going_on_brings_news(self) -> None:
        """When the world goes on by a tick, sequence number and source time both grow."""
        with self._rig(Life.ACTIVE) as rig:
            for _ in range(5):
                last = self._read(rig)
                rig.advance(1)
                new = self._read(rig)
                grown = new.sequence > last.sequence and new.source_time_ns > last.source_time_ns
                require("news", grown, f"{_stamp(new)} after {_stamp(last)}", "a new sample each tick")

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

    def test_sample_after_a_pause_is_new(self) -> None:
        """What is read after a pause, or a fault, was measured after it, and its number is a new one."""
        with self._rig(Life.ACTIVE) as rig:
            for _ in range(4):
                rig.advance(1)
                before = self._read(rig)
            pause_ns = pause(rig)
            for _ in range(3):
                sample = self._read(rig)
                new = sample.source_time_ns >= pause_ns and sample.sequence > before.sequence
                wanted = f"one of {pause_ns} ns or later, with a number above {before.sequence}"
                require("pause", new, _stamp(sample), wanted)

    def test_silence_is_not_passed_off_as_news(self) -> None:
        """Once the newest sample is over age, reading raises DeviceError or gives it marked STALE, at once."""
        with self._rig(Life.ACTIVE) as rig:
            go_silent = knob(rig.go_silent, "go_silent")
            self._read(rig)
            go_silent()
            pass_time(rig, rig.max_age_ns)
            for _ in range(_LONG_SILENCE_TICKS):
                try:
                    sample = self._read(rig)
                except DeviceError:
                    rig.advance(1)
                    continue
                marked = sample.validity in (Validity.STALE, Validity.INVALID)
                observed = f"a {sample.validity.value} sample ({_stamp(sample)})"
                require("silence", marked, observed, f"STALE or DeviceError after {rig.max_age_ns} ns")
                rig.advance(1)
            self._check_quick("silence", rig)


def pause(rig: SensorRig[Any]) -> int:
    """Deactivate a sensor for as long as a sample counts, let it have a fault, and activate it again.

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
    now_ns = rig.clock.now_ns()
    activate(rig.device)
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
