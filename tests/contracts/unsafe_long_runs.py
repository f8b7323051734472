"""Adapters that are sound for a while, or nearly always: what only a long run finds."""

from dataclasses import replace
from math import pi
from typing import Any

from palpate.core.ports import AppliedCommand, JointCommand, Life, Validity, WrenchSample
from tests.contracts.unsafe_lives import moved
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder

S_NS = 10**9


class LosesOneIn(FakeArm):
    """So many commands are applied, then one is told only."""

    every, sent = 256, 0

    def send(self, command: JointCommand) -> AppliedCommand:
        self.sent += 1
        if self.sent % self.every or self._stopped or self._life is not Life.ACTIVE:
            return super().send(command)
        return AppliedCommand(command.position_rad)


class LosesOneInThousand(LosesOneIn):
    every = 1000


class PausesNowAndThen(FakeArm):
    sent = 0

    def send(self, command: JointCommand) -> AppliedCommand:
        self.sent += 1
        if self.sent % 500 == 0:
            self.clock.sleep_until(self.clock.now_ns() + 50_000_000)
        return super().send(command)


class SpeedsUpLater(FakeArm):
    def send(self, command: JointCommand) -> AppliedCommand:
        if self.clock.now_ns() > 20 * S_NS:
            self._max_step_rad = 1.0
        return super().send(command)


class DeafAfterAMinute(FakeArm):
    def stop(self) -> None:
        if self.clock.now_ns() < 60 * S_NS:
            super().stop()


class Sinks(FakeArm):
    """So long after a stop its brakes let go."""

    after_ns, due_ns = 7 * S_NS, 0

    def stop(self) -> None:
        super().stop()
        self.due_ns = self.clock.now_ns() + self.after_ns

    def position_rad(self) -> Any:
        if self.due_ns and self.clock.now_ns() > self.due_ns:
            self.due_ns, self._here_rad = 0, moved(self._here_rad, 1, 0.02)
            self._target_rad = self._here_rad
        return super().position_rad()


class SinksLate(Sinks):
    after_ns = 30 * S_NS


class SinksUntold(Sinks):
    """Active and not commanded for five seconds."""

    after_ns = 5 * S_NS

    def stop(self) -> None:
        FakeArm.stop(self)

    def _on_activate(self) -> None:
        super()._on_activate()
        self.due_ns = self.clock.now_ns() + self.after_ns

    def send(self, command: JointCommand) -> AppliedCommand:
        self.due_ns = 0
        return super().send(command)


class Altering(FakeJointEncoder):
    """From some sample on, or now and then, a sample is another."""

    def read(self) -> Any:
        sample = super().read()
        return self.other(sample) if self.strikes(sample.sequence) else sample

    def strikes(self, number: int) -> bool:
        return number % 300 == 299

    def other(self, sample: Any) -> Any:
        return replace(sample, position_rad=moved(sample.position_rad, 1, 0.05))


class JumpsATurn(Altering):
    def strikes(self, number: int) -> bool:
        return number >= 2000

    def other(self, sample: Any) -> Any:
        return replace(sample, position_rad=moved(sample.position_rad, 1, 2.0 * pi))


class CountsTwice(Altering):
    def other(self, sample: Any) -> Any:
        return replace(sample, sequence=sample.sequence - 1)


class MixesInAnOldJoint(Altering):
    old_rad: Any = (0.0,) * 3

    def strikes(self, number: int) -> bool:
        return number % 150 in (20, 149)

    def other(self, sample: Any) -> Any:
        if sample.sequence % 150 == 20:
            self.old_rad = sample.position_rad
            return sample
        return replace(sample, position_rad=(*sample.position_rad[:2], self.old_rad[2]))


class StaleIsZero(Altering):
    def read(self) -> Any:
        sample = FakeJointEncoder.read(self)
        return sample if sample.validity is Validity.VALID else replace(sample, position_rad=(0.0,) * 3)


class TaresLater(FakeForceSensor):
    zero_N: Any = (0.0,) * 3

    def read(self) -> WrenchSample:
        sample = super().read()
        if sample.sequence == 600:
            self.zero_N = self.load_N
        return replace(sample, force_N=tuple(a - b for a, b in zip(sample.force_N, self.zero_N, strict=True)))


class CountsUntilSilent(FakeForceSensor):
    """Each reading passes for a new sample, but for a stale one."""

    readings = 0

    def read(self) -> WrenchSample:
        sample = super().read()
        self.readings += sample.validity is not Validity.STALE
        return replace(sample, sequence=self.readings)
