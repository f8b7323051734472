"""Devices that would hurt somebody by what they make of a call or a reading, and how such a device is made."""

from collections.abc import Callable
from dataclasses import replace
from math import pi, remainder
from threading import Event, Thread
from time import sleep
from typing import Any

from palpate.core.ports import Validity
from palpate.core.ports.contracts import TICK_NS
from tests.contracts import test_fake as fake
from tests.contracts.broken_sensors import altered
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder

HOME = fake.HOME_RAD


def unsafe(base: Any, name: str, /, **overridden: Any) -> Any:
    """A kind of device in which some methods are others."""
    return type(name, (base,), overridden)


def first(act: Callable[[Any], object], method: str, base: Any = FakeArm) -> Callable[..., Any]:
    """The method, but something happens first."""

    def done(self: Any, *arguments: Any) -> Any:
        act(self)
        return getattr(base, method)(self, *arguments)

    return done


def opened(self: Any) -> None:
    self.is_open = True


def slow(self: Any) -> None:
    self.clock.sleep_until(self.clock.now_ns() + 2 * TICK_NS)


def sleepy(self: Any) -> None:
    self.clock.sleep_until(self.clock.now_ns() + 10**10)


def ask(self: Any) -> None:
    self._require_connection()


# The life of a device


class OpensTwice(FakeForceSensor):
    handles = 0

    def configure(self) -> None:
        self.handles += 1
        super().configure()

    def _on_close(self) -> None:
        self.handles -= 1
        self.is_open = self.handles > 0


class LeavesThread(FakeForceSensor):
    def _on_configure(self) -> None:
        super()._on_configure()
        Thread(target=Event().wait, args=(5.0,), daemon=True).start()


# Calls that block


class AwaitsNews(FakeForceSensor):
    """Reading a second time waits for the next sample."""

    def read(self) -> Any:
        if self._sample is not None and self._sample.source_time_ns == self.clock.now_ns() and not self.silent:
            sleep(0.01)
        return super().read()


class SlowByTheWall(FakeForceSensor):
    """For a while, so that the other clauses need not wait as long."""

    readings = 0

    def read(self) -> Any:
        self.readings += 1
        if self.readings <= 10:
            sleep(0.01)
        return super().read()


class AwaitsTheSilent(FakeForceSensor):
    def read(self) -> Any:
        if self.silent:
            self.clock.sleep_until(self.clock.now_ns() + 10**9)
        return super().read()


# Samples


class EverySecondIsOld(FakeForceSensor):
    """New number and time, but the forces of the sample before."""

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        return replace(sample, force_N=self._sample.force_N) if sequence % 2 and self._sample else sample


class ZeroesItself(FakeForceSensor):
    """A load that stays for long is taken for the tool's weight."""

    since_ns, was_N = 0, (0.0, 0.0, 0.0)

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        if sample.force_N != self.was_N:
            self.was_N, self.since_ns = sample.force_N, now_ns
        return replace(sample, force_N=(0.0,) * 3) if now_ns - self.since_ns > 100 * TICK_NS else sample


class ZeroNowAndThen(FakeForceSensor):
    """One sample in 64 is zero, and as good as the others."""

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        return replace(sample, force_N=(0.0,) * 3) if sequence % 64 == 63 else sample


class WrapsAtOneTurn(FakeJointEncoder):
    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        return replace(sample, position_rad=tuple(remainder(q, 2.0 * pi) for q in sample.position_rad))


class Sticks(FakeJointEncoder):
    """A turn of less than 0.4 mrad does not show."""

    shown: Any = None

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        pairs = zip(sample.position_rad, self.shown or sample.position_rad, strict=True)
        self.shown = tuple(q if abs(q - old) >= 4e-4 else old for q, old in pairs)
        return replace(sample, position_rad=self.shown)


class SlipsNowAndThen(FakeJointEncoder):
    """One sample in 64 is a turn off."""

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        slip = 2.0 * pi * (sequence % 64 == 63)
        return replace(sample, position_rad=tuple(q + slip for q in sample.position_rad))


class CountsFromZeroAgain(FakeForceSensor):
    """The first sample after a pause has number 0 again, which whoever counts takes for an old one."""

    first = 0

    def _on_activate(self) -> None:
        self.first = 0 if self._sample is None else self._sample.sequence + 1

    def read(self) -> Any:
        sample = super().read()
        return replace(sample, sequence=sample.sequence - self.first)


class ClipsTorque(FakeForceSensor):
    """What it clips is marked in force, and not in torque."""

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        clipped = tuple(max(-1.1, min(1.1, t)) for t in sample.torque_Nm)
        marked = Validity.SATURATED if max(map(abs, sample.force_N)) > 20.0 else sample.validity
        return replace(sample, torque_Nm=clipped, validity=marked)


def frozen(self: Any, now_ns: int, sequence: int) -> Any:
    sample = FakeJointEncoder._measured(self, now_ns, sequence)
    return replace(sample, position_rad=self._sample.position_rad) if self._sample else sample


FIRST_FLIPPED = altered(FakeJointEncoder, position_rad=lambda s: (-s.position_rad[0], *s.position_rad[1:]))
SWAPPED = altered(FakeJointEncoder, position_rad=lambda s: (s.position_rad[1], s.position_rad[0], s.position_rad[2]))
MIRRORED = altered(FakeForceSensor, force_N=lambda s: (-s.force_N[0], *s.force_N[1:]))


def set_paused(self: Any) -> None:
    self.paused = True


def rezeroed(self: Any, now_ns: int, sequence: int) -> Any:
    """After a pause the sensor begins at zero again."""
    sample = FakeForceSensor._measured(self, now_ns, sequence)
    return replace(sample, force_N=(0.0, 0.0, 0.0)) if getattr(self, "paused", False) else sample


def set_failed(self: Any, cause: str = "overload") -> None:
    self.paused = True
    self._latch(cause)


def lost(self: Any, now_ns: int, sequence: int) -> Any:
    """After a fault the encoder counts from zero."""
    sample = FakeJointEncoder._measured(self, now_ns, sequence)
    return replace(sample, position_rad=(0.0,) * 3) if getattr(self, "paused", False) else sample


SWAPS_PULLS = altered(FakeForceSensor, force_N=lambda s: s.force_N if min(s.force_N[:2]) >= 0.0 else s.force_N[::-1])
ABSOLUTE = altered(FakeForceSensor, torque_Nm=lambda s: tuple(map(abs, s.torque_Nm)))

INSENSITIVE = altered(FakeForceSensor, force_N=lambda s: tuple(f if abs(f) > 2.0 else 0.0 for f in s.force_N))
EITHER = altered(FakeForceSensor, torque_Nm=lambda s: (0.0,) * 3 if any(s.force_N) else s.torque_Nm)
