"""Sensors by which somebody would be hurt: each a good fake with one thing overridden."""

from dataclasses import replace
from math import pi, remainder
from typing import Any

from palpate.core.ports import Life, Validity
from tests.fake_devices import FakeForceSensor, FakeJointEncoder


class WrapsAtOneTurn(FakeJointEncoder):
    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        return replace(sample, position_rad=tuple(remainder(q, 2.0 * pi) for q in sample.position_rad))


class OneJointATick(FakeJointEncoder):
    """Of joints that turn together, one lags a tick behind the other."""

    shown: Any = None

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        shown = list(self.shown or sample.position_rad)
        k = max(range(3), key=lambda i: abs(sample.position_rad[i] - shown[i]))
        shown[k] = sample.position_rad[k]
        self.shown = tuple(shown)
        return replace(sample, position_rad=self.shown)


class SleepsWithTheArm(FakeJointEncoder):
    """Frozen while the arm is not active."""

    arm: Any

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample, last = super()._measured(now_ns, sequence), self._sample
        asleep = last is not None and self.arm.life is not Life.ACTIVE
        return replace(sample, position_rad=last.position_rad) if asleep and last is not None else sample


class WakesWhereItFellAsleep(FakeJointEncoder):
    """The pose of before a pause, as if it had just been measured, for as long as no joint is driven."""

    asleep_rad: Any = None

    def _on_deactivate(self) -> None:
        self.asleep_rad = None if self._sample is None else self._sample.position_rad

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        return replace(sample, position_rad=self.asleep_rad) if self.asleep_rad else sample


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


# Of any sensor


class CountsFromZeroAgain(FakeForceSensor):
    """The first sample after a pause has number 0 again, which whoever counts takes for an old one."""

    first = 0

    def _on_activate(self) -> None:
        self.first = 0 if self._sample is None else self._sample.sequence + 1

    def read(self) -> Any:
        sample = super().read()
        return replace(sample, sequence=sample.sequence - self.first)


class ClockRunsSlow(FakeForceSensor):
    """Its samples are said to be older and older."""

    first_ns = 0

    def read(self) -> Any:
        sample = super().read()
        self.first_ns = self.first_ns or sample.source_time_ns
        late_ns = (sample.source_time_ns - self.first_ns) // 20
        return replace(sample, source_time_ns=sample.source_time_ns - late_ns)


class OverloadShiftsItsZero(FakeForceSensor):
    """After more than 100 N nothing is as it was, and nobody is told."""

    zero_N = 0.0

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        x, y, z = sample.force_N
        found = replace(sample, force_N=(x, y, z + self.zero_N))
        self.zero_N = 3.0 if max(map(abs, sample.force_N)) > 100.0 else self.zero_N
        return found


class ClipsTorque(FakeForceSensor):
    """What it clips is marked in force, and not in torque."""

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        clipped = tuple(max(-1.1, min(1.1, t)) for t in sample.torque_Nm)
        marked = Validity.SATURATED if max(map(abs, sample.force_N)) > 20.0 else sample.validity
        return replace(sample, torque_Nm=clipped, validity=marked)
