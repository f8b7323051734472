"""An arm on a field bus as the two arm ports: a thread cycles the bus, the ports read and write its newest values."""

from __future__ import annotations

import threading
from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

from palpate.adapters.hardware.errors import told, translating
from palpate.core.errors import CommandError, DeviceError
from palpate.core.ports.devices import ArmCommand, Clock, JointEncoder
from palpate.core.ports.lifecycle import Life, ManagedDevice
from palpate.core.ports.values import (
    CONTROL_RATE_HZ,
    AppliedCommand,
    CommandReason,
    JointCommand,
    JointSample,
    JointVector,
    Validity,
)
from palpate.drivers.errors import DriverError

_NS: Final = 1_000_000_000
_PATIENCE_NS: Final = 3 * _NS
"""Longest wait for the thread to do what it was told; a cycle takes milliseconds, a stop a fraction of a second."""
_POLL_NS: Final = 1_000_000
"""How often such a wait looks up."""


@dataclass(frozen=True, slots=True)
class BusCycle:
    """What one bus cycle brought back.

    Attributes:
        position_rad: Joint angles, (n,).
        time_ns: When they were measured, run clock.
    """

    position_rad: JointVector
    time_ns: int


class ArmDriver(Protocol):
    """What the adapter needs of a driver. Only ``preview`` is called from another thread than the rest."""

    @abstractmethod
    def open(self) -> None:
        """Open the bus, find the arm, know where it is."""

    @abstractmethod
    def enable(self) -> None:
        """Let the servos hold the arm where it stands."""

    @abstractmethod
    def preview(self, asked_rad: JointVector) -> AppliedCommand:
        """What a cycle would make of a set-point now."""

    @abstractmethod
    def cycle(self, setpoint_rad: JointVector | None) -> BusCycle:
        """One cycle; None holds."""

    @abstractmethod
    def stop(self) -> None:
        """Bring the arm to rest; at any time, twice too, never raising."""

    @abstractmethod
    def disable(self) -> None:
        """End what ``enable`` began."""

    @abstractmethod
    def acknowledge(self) -> None:
        """Clear a fault; a person's decision."""

    @abstractmethod
    def close(self) -> None:
        """Stop, and release the bus; never raising."""


class BusArm(ManagedDevice, JointEncoder, ArmCommand):
    """Encoders and servos of an arm on a bus, at a whole fraction of the control rate; the newest command wins.

    Args:
        name: Name for messages.
        driver: Talks to the arm.
        clock: The run's clock, real time.
        joints: Number of joints.
        divider: Control ticks per bus cycle.
        max_age_ns: Age above which a sample is marked ``STALE``.
        hurry: Called first by the thread.
    """

    def __init__(
        self,
        name: str,
        driver: ArmDriver,
        clock: Clock,
        *,
        joints: int,
        divider: int,
        max_age_ns: int,
        hurry: Callable[[], object] | None = None,
    ) -> None:
        super().__init__(name)
        self._hurry = hurry
        self._driver, self._clock, self._joints = driver, clock, joints
        self._divider, self._max_age_ns = divider, max_age_ns
        self._thread: threading.Thread | None = None
        # One writer each, and every value is replaced whole: no lock is needed, and a signal handler may call stop().
        self._newest: JointVector | None = None
        self._sample: JointSample | None = None
        self._cycles = 0
        self._end = self._stop_wanted = self._stopped = False

    @property
    def driver(self) -> ArmDriver:
        """Talks to the arm. For ``palpate doctor``, which uses it while the arm is configured and no thread runs."""
        return self._driver

    def read(self) -> JointSample:
        """See :class:`JointEncoder`."""
        if self._life is not Life.ACTIVE:
            self._require_active("read()")
        sample = self._sample
        if sample is None:
            raise DeviceError(self.name, "has not delivered a sample yet")
        if self._clock.now_ns() - sample.source_time_ns > self._max_age_ns:
            old = (sample.source_time_ns, sample.receive_time_ns, sample.sequence)
            return JointSample(sample.position_rad, *old, Validity.STALE)
        return sample

    def send(self, command: JointCommand) -> AppliedCommand:
        """See :class:`ArmCommand`."""
        if self._life is not Life.ACTIVE:
            self._require_active("send()")
        asked = command.position_rad
        if len(asked) != self._joints:
            raise CommandError(f"the arm has {self._joints} joints, the command has another number", len(asked))
        if self._stop_wanted:
            return AppliedCommand(self._where(), CommandReason.STOPPED)
        with translating(self.name):
            applied = self._driver.preview(asked)
        self._newest = asked
        return applied

    def stop(self) -> None:
        """See :class:`ArmCommand`. Returns when the arm has been told, or nobody is left to tell it."""
        self._stop_wanted = True
        thread = self._thread
        if thread is None or not thread.is_alive():
            if self._life in (Life.CONFIGURED, Life.ACTIVE, Life.FAULTED):
                self._driver.stop()
            return
        self._wait(lambda: self._stopped or not thread.is_alive())

    def _where(self) -> JointVector:
        return () if self._sample is None else self._sample.position_rad

    def _run(self) -> None:
        """The thread: cycle after cycle at absolute times, until told to end or something fails."""
        if self._hurry is not None:
            self._hurry()
        start_ns, slot = self._clock.now_ns(), 0
        try:
            while not self._end:
                self._clock.sleep_until(start_ns + slot * _NS * self._divider // CONTROL_RATE_HZ)
                now_ns = self._clock.now_ns()
                if self._stop_wanted and not self._stopped:
                    self._driver.stop()
                    self._stopped = True
                cycle = self._driver.cycle(None if self._stopped else self._newest)
                self._cycles += 1
                self._sample = JointSample(cycle.position_rad, cycle.time_ns, self._clock.now_ns(), self._cycles)
                slot = max(slot + 1, (now_ns - start_ns) * CONTROL_RATE_HZ // (_NS * self._divider) + 1)
        except DriverError as error:
            self._latch(told(error))
            self._driver.stop()
        except Exception as error:
            # Whatever it was: without its cycles the arm must not go on.
            self._latch(f"the bus thread failed: {error!r}")
            self._driver.stop()

    def _end_thread(self) -> None:
        thread, self._thread = self._thread, None
        if thread is not None:
            self._end = True
            self._wait(lambda: not thread.is_alive())

    def _wait(self, done: Callable[[], bool]) -> None:
        """Wait for the thread, on the run's clock; not for ever."""
        deadline_ns = self._clock.now_ns() + _PATIENCE_NS
        while not done() and self._clock.now_ns() < deadline_ns:
            self._clock.sleep_until(self._clock.now_ns() + _POLL_NS)

    def _on_configure(self) -> None:
        try:
            with translating(self.name):
                self._driver.open()
        except BaseException:
            self._driver.close()
            raise

    def _on_activate(self) -> None:
        with translating(self.name):
            self._driver.enable()
        self._newest = self._sample = None
        self._end = self._stop_wanted = self._stopped = False
        thread = threading.Thread(target=self._run, name=f"{self.name} bus", daemon=True)
        self._thread = thread
        thread.start()
        self._wait(lambda: self._sample is not None or not thread.is_alive())
        if self._sample is None:
            raise DeviceError(self.name, self.fault or "delivers no joint angles")

    def _on_deactivate(self) -> None:
        self._end_thread()
        with translating(self.name):
            self._driver.stop()
            self._driver.disable()

    def _on_acknowledge(self) -> None:
        self._end_thread()
        with translating(self.name):
            self._driver.acknowledge()

    def _on_close(self) -> None:
        self._end_thread()
        self._driver.stop()
        self._driver.close()
