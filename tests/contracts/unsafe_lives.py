"""Adapters that change in the course of their life: by the trial, a fault, what they refused; what errors hide."""

from dataclasses import replace
from threading import Event, Thread
from typing import Any

from palpate.core.errors import DeviceError, FaultLatchedError, LifecycleError
from palpate.core.ports import AppliedCommand, JointCommand, JointSample, Life, Validity, WrenchKind, WrenchSample
from palpate.core.ports.contracts import TICK_NS
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder


def moved(angles: Any, joint: int, way: float) -> Any:
    """The angles, one of them by so much more."""
    return tuple(q + way * (k == joint) for k, q in enumerate(angles))


def leave_thread() -> None:
    Thread(target=Event().wait, args=(5.0,), daemon=True).start()


class Counts:
    """Which trial this is, and how many faults there were."""

    trials = faults = acknowledged = 0

    def _on_activate(self) -> None:
        super()._on_activate()  # type: ignore[misc]
        self.trials += 1

    def fail(self, cause: str = "motor 2: over-current") -> None:
        self.faults += 1
        super().fail(cause)  # type: ignore[misc]

    def _on_acknowledge(self) -> None:
        super()._on_acknowledge()  # type: ignore[misc]
        self.acknowledged += 1


class CountingArm(Counts, FakeArm): ...


class CountingEncoder(Counts, FakeJointEncoder): ...


class CountingSensor(Counts, FakeForceSensor):
    def read(self) -> WrenchSample:
        return self.changed(super().read())

    def changed(self, sample: Any) -> Any:
        return sample


# Arms


class QueueAfterSecondFault(CountingArm):
    """What was under way at a fault is carried out once it is acknowledged; not the first time."""

    left_rad: Any = None

    def fail(self, cause: str = "motor 2: over-current") -> None:
        self.left_rad = self._target_rad
        super().fail(cause)

    def _on_acknowledge(self) -> None:
        super()._on_acknowledge()
        if self.acknowledged > 1:
            self._target_rad, self._target_since_ns = self.left_rad, self.clock.now_ns()


class DeafAfterFault(CountingArm):
    def stop(self) -> None:
        if not self.faults:
            super().stop()


class ShiftsAtFourthTrial(CountingArm):
    def send(self, command: JointCommand) -> AppliedCommand:
        applied = super().send(command)
        if self.trials >= 4 and not self._stopped:
            self._target_rad = moved(self._target_rad, 0, 2e-3)
        return applied


class MirroredAfterFault(CountingArm):
    def send(self, command: JointCommand) -> AppliedCommand:
        applied, here = super().send(command), self._here_rad
        if self.acknowledged:
            self._target_rad = (2 * here[0] - self._target_rad[0], *self._target_rad[1:])
        return applied


class LimitlessAfterFault(CountingArm):
    def _on_acknowledge(self) -> None:
        super()._on_acknowledge()
        self._upper_rad, self._lower_rad = (9.0,) * 3, (-9.0,) * 3


class LimitlessInSecondTrial(CountingArm):
    def _on_activate(self) -> None:
        super()._on_activate()
        if self.trials == 2:
            self._upper_rad, self._lower_rad = (9.0,) * 3, (-9.0,) * 3


class RunsOnAfterThirdTrial(CountingArm):
    def _on_deactivate(self) -> None:
        if self.trials < 3:
            super()._on_deactivate()


class LatchesOnce(CountingArm):
    def _latch(self, cause: str) -> None:
        if self.faults < 2:
            super()._latch(cause)


class LatchesInMotionOnly(FakeArm):
    def _latch(self, cause: str) -> None:
        if not self._stopped:
            super()._latch(cause)


class StopRenamesFault(FakeArm):
    def stop(self) -> None:
        super().stop()
        self._fault = self._fault and "stopped by the operator"


class FaultFades(FakeArm):
    looks = 0

    @property
    def fault(self) -> str | None:
        self.looks += self._fault is not None
        return self._fault if self.looks < 5 else self._fault and "unknown cause"


class HomesWhenConfigured(FakeArm):
    def _on_configure(self) -> None:
        super()._on_configure()
        self._target_rad, self._target_since_ns = (0.0,) * 3, self.clock.now_ns()


class FallsWhenStoppedAtRest(FakeArm):
    """A stop while it is not active opens a brake."""

    def stop(self) -> None:
        super().stop()
        if self._life is Life.CONFIGURED:
            self._here_rad = self._target_rad = moved(self._here_rad, 1, 0.01)


class AcknowledgingFrees(FakeArm):
    def acknowledge_fault(self) -> None:
        self._stopped = False
        super().acknowledge_fault()


class ActivatingFrees(FakeArm):
    """Refused, as it should be, but the stop is forgotten."""

    def activate(self) -> None:
        self._stopped = self._stopped and self._life is not Life.ACTIVE
        super().activate()


class ConfiguringFrees(FakeArm):
    def configure(self) -> None:
        self._stopped = self._stopped and self._life is not Life.ACTIVE
        super().configure()


class KeepsThreadAfterFault(CountingArm):
    def _on_close(self) -> None:
        super()._on_close()
        if self.faults:
            leave_thread()


class StaysOpenAfterFault(CountingArm):
    def _on_close(self) -> None:
        super()._on_close()
        self.is_open = self.faults > 0


class SaysError(FakeArm):
    def fail(self, cause: str = "") -> None:
        super().fail("error 17")


class Nameless(FakeArm):
    def _refuse(self, request: str, accepted: str) -> None:
        if self._life is Life.FAULTED:
            raise FaultLatchedError("", str(self._fault))
        raise LifecycleError("", self._life.value, request, accepted)


class CutTold(FakeArm):
    """The error of a cut cable names nothing."""

    told: Any = ("", "does not answer")

    def _require_connection(self) -> None:
        if self.disconnected:
            raise DeviceError(*self.told)


class CutOnce(FakeArm):
    """The cut cable is told once, after that commands are applied in its mind only."""

    told = False

    def send(self, command: JointCommand) -> AppliedCommand:
        if self.disconnected and self.told and self._life is Life.ACTIVE:
            return AppliedCommand(command.position_rad)
        self.told = self.disconnected
        return super().send(command)


class MovesOnWithoutCable(FakeArm):
    def position_rad(self) -> Any:
        if self.disconnected and self._life is Life.ACTIVE:
            self._here_rad = self._target_rad = moved(self._here_rad, 0, 1e-3)
        return super().position_rad()


class SlowStop(FakeArm):
    def stop(self) -> None:
        super().stop()
        self.clock.sleep_until(self.clock.now_ns() + 700_000_000)


# Encoders and force sensors


class ShiftsAtSixthTrial(CountingEncoder):
    def read(self) -> JointSample:
        sample = super().read()
        return replace(sample, position_rad=moved(sample.position_rad, 0, 0.1)) if self.trials >= 6 else sample


class ClockSetBack(CountingEncoder):
    def read(self) -> JointSample:
        sample = super().read()
        late_ns = 50 * TICK_NS if self.trials > 1 else 0
        source_ns, receive_ns = sample.source_time_ns - late_ns, sample.receive_time_ns - late_ns
        return replace(sample, source_time_ns=source_ns, receive_time_ns=receive_ns)


class ReadsFaulted(FakeJointEncoder):
    def read(self) -> JointSample:
        if self._life is Life.FAULTED and self._sample:
            return replace(self._sample, validity=Validity.STALE)
        return super().read()


class LastKnown(FakeJointEncoder):
    """Of a cut cable it tells once, and then gives what it had last."""

    told = False

    def read(self) -> JointSample:
        if self.disconnected and self.told and self._sample:
            return self._sample
        self.told = self.disconnected
        return super().read()


class SwapsInSecondTrial(CountingSensor):
    def changed(self, sample: Any) -> Any:
        x, y, z = sample.force_N
        return replace(sample, force_N=(y, x, z)) if self.trials > 1 else sample


class SwapsTorqueAfterFault(CountingSensor):
    def changed(self, sample: Any) -> Any:
        x, y, z = sample.torque_Nm
        return replace(sample, torque_Nm=(y, x, z)) if self.acknowledged else sample


class TaresAtFourthTrial(CountingSensor):
    def changed(self, sample: Any) -> Any:
        return replace(sample, force_N=(0.0,) * 3) if self.trials >= 4 else sample


class TaresTorque(CountingSensor):
    zero_Nm: Any = None

    def _on_activate(self) -> None:
        super()._on_activate()
        self.zero_Nm = None

    def changed(self, sample: Any) -> Any:
        self.zero_Nm = self.zero_Nm or sample.torque_Nm
        return replace(sample, torque_Nm=tuple(a - b for a, b in zip(sample.torque_Nm, self.zero_Nm, strict=True)))


class MarksInFirstTrialOnly(CountingSensor):
    def changed(self, sample: Any) -> Any:
        if max(map(abs, sample.force_N)) <= 100.0:
            return sample
        validity = Validity.SATURATED if self.trials < 2 else Validity.VALID
        return replace(sample, force_N=tuple(max(-100.0, min(100.0, f)) for f in sample.force_N), validity=validity)


class SaysTaredInSecondTrial(CountingSensor):
    def changed(self, sample: Any) -> Any:
        return replace(sample, kind=WrenchKind.TARED) if self.trials > 1 else sample


class YieldsAtSecondFault(CountingSensor):
    def activate(self) -> None:
        if self.faults > 1 and self._life is Life.FAULTED:
            self._life, self._fault = Life.CONFIGURED, None
        super().activate()


class FailedLeavesThread(FakeForceSensor):
    def _on_configure(self) -> None:
        if self.disconnected:
            leave_thread()
        super()._on_configure()


class FaultUnreadable(FakeForceSensor):
    @property
    def fault(self) -> str | None:
        if self._life is Life.CLOSED:
            raise OSError("bad file descriptor")
        return self._fault


class CutSaysError(FakeForceSensor):
    def _require_connection(self) -> None:
        if self.disconnected:
            raise DeviceError("force sensor", "device error")


class AwakeInSilence(CountingSensor):
    """Silent over a pause, it gives the old sample anew, and as good."""

    def changed(self, sample: Any) -> Any:
        now_ns = self.clock.now_ns()
        if not self.silent or self.trials < 2:
            return sample
        return WrenchSample(sample.force_N, sample.torque_Nm, now_ns, now_ns, sample.sequence + 1)


class ZerosAtFirst(FakeForceSensor):
    def read(self) -> WrenchSample:
        if self.silent and self._sample is None and self._life is Life.ACTIVE:
            return WrenchSample((0.0,) * 3, (0.0,) * 3, self.clock.now_ns(), self.clock.now_ns(), 0)
        return super().read()
