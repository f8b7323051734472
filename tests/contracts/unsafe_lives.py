"""Adapters that change in the course of their life: by the trial, a fault, what they refused; what errors hide."""

from dataclasses import replace
from threading import Event, Thread
from typing import Any

from palpate.core.errors import DeviceError
from palpate.core.ports import JointSample, Life, Validity, WrenchKind, WrenchSample
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


class CutTold(FakeArm):
    """The error of a cut cable names nothing."""

    told: Any = ("", "does not answer")

    def _require_connection(self) -> None:
        if self.disconnected:
            raise DeviceError(*self.told)


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


class ClockSetBack(CountingEncoder):
    def read(self) -> JointSample:
        sample = super().read()
        late_ns = 50 * TICK_NS if self.trials > 1 else 0
        source_ns, receive_ns = sample.source_time_ns - late_ns, sample.receive_time_ns - late_ns
        return replace(sample, source_time_ns=source_ns, receive_time_ns=receive_ns)


class SwapsTorqueAfterFault(CountingSensor):
    def changed(self, sample: Any) -> Any:
        x, y, z = sample.torque_Nm
        return replace(sample, torque_Nm=(y, x, z)) if self.acknowledged else sample


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


class FailedLeavesThread(FakeForceSensor):
    def _on_configure(self) -> None:
        if self.disconnected:
            leave_thread()
        super()._on_configure()


class CutSaysError(FakeForceSensor):
    def _require_connection(self) -> None:
        if self.disconnected:
            raise DeviceError("force sensor", "device error")


class ZerosAtFirst(FakeForceSensor):
    def read(self) -> WrenchSample:
        if self.silent and self._sample is None and self._life is Life.ACTIVE:
            return WrenchSample((0.0,) * 3, (0.0,) * 3, self.clock.now_ns(), self.clock.now_ns(), 0)
        return super().read()
