"""Base class for force sensor adapters with polled drivers: reading, sample age, faults and closing."""

from abc import abstractmethod
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated, ClassVar, Final, Generic, TypeVar

from palpate.adapters.hardware.clock import sleeping
from palpate.adapters.hardware.errors import message_of, translated, translating
from palpate.core.errors import DeviceError
from palpate.core.ports import Clock, ForceSensor, Life, ManagedDevice, Range, Settings, Validity, WrenchSample
from palpate.drivers.device import ForceSample, PolledSensor
from palpate.drivers.errors import DriverError, SilentError

DriverT = TypeVar("DriverT", bound=PolledSensor)
_LINE_NS: Final = 20_000_000
"""Delay, beyond the sensor's period, after which a reading counts as missing; it allows for the line and the system."""


_DRAIN_NS: Final = 1_000_000_000
"""Maximum time for discarding buffered data."""


@dataclass(frozen=True)
class SensorTable(Settings):
    """Settings common to the ``[force_sensor]`` tables of palpate's drivers."""

    TABLE: ClassVar[str] = "force_sensor"

    max_age_ms: Annotated[float, Range(1.0, 10_000.0)] = 50.0
    """Age above which a sample is marked as stale."""
    start_timeout_s: Annotated[float, Range(0.1, 600.0)] = 5.0
    """Maximum time to wait for the first reading."""


class PolledForceSensor(ManagedDevice, ForceSensor, Generic[DriverT]):
    """A wrist sensor with a polled driver. Samples are raw, because the adapter never tares on its own.

    The protocols do not transmit the measurement time. Source and receive times are both the time of the poll. The
    reading is older because of the sensor's filter, the line, and the wait for the poll.
    """

    REMEDY: ClassVar[str] = "look at it"
    """Remedy if the sensor is connected but sends nothing."""

    def __init__(self, name: str, clock: Clock, table: SensorTable) -> None:
        super().__init__(name)
        self._clock, self._sleep = clock, sleeping(clock)
        self._max_age_ns = round(table.max_age_ms * 1e6)
        self._start_timeout_s = table.start_timeout_s
        self._close_wire: Callable[[], None] | None = None
        self.device: DriverT | None = None
        self._polled_ns = 0
        self._undated: int | None = None

    @property
    @abstractmethod
    def period_ns(self) -> int:
        """Return the time between two readings in ns."""

    @abstractmethod
    def _connect(self) -> None:
        """Open the line, and set ``device``. Set ``_close_wire`` if there is something to close."""

    def _leave(self, device: DriverT) -> None:
        """Shut the device down before the line is closed. By default, do nothing."""

    def _surprise(self, device: DriverT) -> str | None:
        """Return an unexpected event from the device that must end the run, or None."""
        return None

    def read(self) -> WrenchSample:
        """Poll the device and return its latest sample."""
        if self._life is not Life.ACTIVE:
            self._require_active("read()")
        device = self._polled()
        surprise = self._surprise(device)
        if surprise is not None:
            self._fail(surprise)
        sample = device.latest
        if sample is None:
            raise DeviceError(self.name, "has not delivered a sample yet")
        return self._made(sample)

    def account(self) -> str:
        """Describe what was received instead of new readings, or return "" if the latest reading is on time."""
        device, now_ns = self.device, self._clock.now_ns()
        if device is None:
            return ""
        latest = device.latest
        if latest is not None and now_ns - latest.receive_time_ns <= 2 * self.period_ns + _LINE_NS:
            return ""
        return message_of(device.silence(now_ns), self.name)

    def diagnostics(self) -> dict[str, str]:
        """Return the driver's diagnostics, or an empty mapping before ``configure``."""
        return {} if self.device is None else self.device.diagnostics()

    def opened(self) -> DriverT:
        """The driver. Raises DeviceError before ``configure``."""
        if self.device is None:
            raise DeviceError(self.name, "is not open")
        return self.device

    def _polled(self) -> DriverT:
        device = self.opened()
        try:
            now_ns = self._clock.now_ns()
            device.poll(now_ns)
            device.check()
            if now_ns - self._polled_ns > self._max_age_ns:
                self._look_for_news(device)
            self._polled_ns = self._clock.now_ns()
        except SilentError as error:
            # An old sample is marked; a lost device must raise an error.
            latest = device.latest
            if latest is None or self._clock.now_ns() - latest.receive_time_ns > 10 * self._max_age_ns:
                self._fail(f"has fallen silent: {message_of(error, self.name)}", error)
        except DriverError as error:
            self._latch(str(error))
            raise translated(error, self.name) from error
        return device

    def _look_for_news(self, device: DriverT) -> None:
        """After a long pause, discard buffered data, which may be as old as the pause, and wait for a new reading."""
        deadline_ns = self._clock.now_ns() + 3 * self.period_ns + _LINE_NS
        # A poll reads a limited amount.
        while device.poll(self._clock.now_ns()) and self._clock.now_ns() < deadline_ns:
            device.check()
        waiting = None if device.latest is None else device.latest.sequence
        while self._clock.now_ns() < deadline_ns:
            self._sleep(0.001)
            device.poll(self._clock.now_ns())
            device.check()
            if device.latest is not None and device.latest.sequence != waiting:
                self._undated = None
                return
        self._undated = waiting

    def _made(self, sample: ForceSample) -> WrenchSample:
        validity = Validity.VALID
        if sample.settling:
            validity = Validity.INVALID
        elif sample.sequence == self._undated:
            validity = Validity.STALE
        elif self._clock.now_ns() - sample.receive_time_ns > self._max_age_ns:
            validity = Validity.STALE
        elif sample.saturated:
            validity = Validity.SATURATED
        time_ns = sample.receive_time_ns
        return WrenchSample(sample.force_N, sample.torque_Nm, time_ns, time_ns, sample.sequence, validity)

    def _fail(self, problem: str, cause: Exception | None = None) -> None:
        self._latch(problem)
        raise DeviceError(self.name, problem) from cause

    def _on_configure(self) -> None:
        try:
            with translating(self.name):
                self._connect()
        except BaseException:
            # The line is released for another attempt.
            self._on_close()
            raise

    def _on_activate(self) -> None:
        """Wait for a new reading and, after a start, for the filter to settle. Earlier silence is not a fault."""
        device, begin_ns = self.opened(), self._clock.now_ns()
        deadline_ns = begin_ns + round(self._start_timeout_s * 1e9)
        # Data waiting in the line may be old, and a poll takes only part; a slow computer finds new data each time.
        while device.poll(self._clock.now_ns()) and self._clock.now_ns() < min(deadline_ns, begin_ns + _DRAIN_NS):
            pass
        before = device.latest
        with translating(self.name):
            while device.latest is None or device.latest is before or device.latest.settling:
                if device.failure is not None:
                    self._latch(str(device.failure))
                    raise device.failure
                if self._clock.now_ns() > deadline_ns:
                    raise SilentError(self.name, "delivers no settled reading", self.REMEDY)
                self._sleep(0.002)
                device.poll(self._clock.now_ns())
        self._polled_ns, self._undated = self._clock.now_ns(), None

    def _on_acknowledge(self) -> None:
        if self.device is not None:
            self.device.acknowledge()

    def _on_close(self) -> None:
        device, close_wire = self.device, self._close_wire
        self.device = self._close_wire = None
        try:
            if device is not None:
                self._leave(device)
        except DriverError:
            # The device no longer responds; the line must be released in any case.
            return
        finally:
            if close_wire is not None:
                with suppress(Exception):
                    # A missing adapter cannot close its bus, and raises errors of many types.
                    close_wire()

    def _is_sound(self, device: DriverT) -> bool:
        """Return True if the device can be expected to answer."""
        device.poll(self._clock.now_ns())
        try:
            device.check()
        except DriverError:
            return False
        return self._life is not Life.FAULTED
