"""The JR3 driver as a force sensor: wiring and marks, nothing else."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Final

from palpate.adapters.config import SensorFactsTable, overlay
from palpate.adapters.hardware.can_table import CanBusTable
from palpate.adapters.hardware.errors import told, translated, translating
from palpate.adapters.hardware.plugins import DeviceSettings, RigContext
from palpate.core.errors import DeviceError
from palpate.core.ports import Clock, ForceSensor, Life, ManagedDevice, OneOf, Range, Settings, Validity, WrenchSample
from palpate.drivers.can_link import CanLink, open_bus
from palpate.drivers.errors import DriverError, SilentError
from palpate.drivers.jr3 import (
    LEFT_HANDED,
    RIGHT_HANDED,
    CanTransport,
    Jr3,
    Jr3Sample,
    Jr3Settings,
    Pace,
    Transport,
    UartLink,
    UartTransport,
    shut_down,
    start_up,
)
from palpate.drivers.serial_port import close_serial, open_serial

_NAME: Final = "JR3"


@dataclass(frozen=True)
class OpenWire:
    """A wire to the board, open.

    Attributes:
        wire: What the driver talks over.
        close: Closes bus or port.
    """

    wire: Transport
    close: Callable[[], None]


_LEAVE_S: Final = 5.0
"""Longest wait for a board to take the end of its stream; one on a serial line sleeps 1 s after each command (FACT)."""
_DEAD_S: Final = 0.2
"""The same for a board that has failed: it is told, and may have no way to answer."""
_LINE_NS: Final = 20_000_000
"""What line and system may add to the sensor's own period before a reading counts as missing."""


class Jr3ForceSensor(ManagedDevice, ForceSensor):
    """A JR3 wrist sensor. Never tares by itself: samples are raw.

    The protocol carries no time of measurement: source and receive time are both that of the poll that found the
    reading, which is older by the filter's delay, the wire, and the wait for the poll.

    Args:
        open_wire: Opens the wire; called by ``configure``.
        settings: Filter, rate and signs.
        clock: The run's clock.
        max_age_ns: Age above which a sample is marked ``STALE``.
        start_timeout_s: Longest wait for the first reading.

    Attributes:
        device: The driver; None before ``configure``. For ``palpate doctor``.
    """

    def __init__(
        self,
        open_wire: Callable[[], OpenWire],
        settings: Jr3Settings,
        clock: Clock,
        *,
        max_age_ns: int,
        start_timeout_s: float = 30.0,
    ) -> None:
        super().__init__(_NAME)
        self._open_wire, self._settings, self._clock = open_wire, settings, clock
        self._max_age_ns, self._start_timeout_s = max_age_ns, start_timeout_s
        self._opened: OpenWire | None = None
        self.device: Jr3 | None = None
        self._polled_ns = 0
        self._undated: int | None = None

    @property
    def settings(self) -> Jr3Settings:
        """Filter, rate and signs."""
        return self._settings

    def reported_facts(self) -> SensorFactsTable:
        """Full scales and rate, as the board reports them. It does not report its noise.

        Raises:
            DeviceError: It is not configured.
        """
        if self.device is None:
            raise DeviceError(_NAME, "is not open")
        identity = self.device.identity
        x, y, z = identity.full_scales.force_N
        tx, ty, tz = identity.full_scales.moment_dNm
        return SensorFactsTable(
            range_N=(float(x), float(y), float(z)),
            range_Nm=(tx / 10, ty / 10, tz / 10),
            rate_Hz=1e6 / identity.period_us,
            frame="sensor",
        )

    def read(self) -> WrenchSample:
        """Poll the board and give its newest sample.

        Raises:
            DeviceError: Besides silence: the board restarted in mid-run, so its readings may have jumped.
        """
        if self._life is not Life.ACTIVE:
            self._require_active("read()")
        device = self._polled()
        sample = device.latest
        if device.after_boot or device.zero_lost:
            self._fail("the board restarted in mid-run: readings may have jumped")
        if sample is None:
            raise DeviceError(_NAME, "has not delivered a sample yet")
        return self._made(sample)

    def _polled(self) -> Jr3:
        device = self.device
        if device is None:
            raise DeviceError(_NAME, "is not open")
        try:
            now_ns = self._clock.now_ns()
            device.poll(now_ns)
            device.check()
            if now_ns - self._polled_ns > self._max_age_ns:
                self._look_for_news(device)
            self._polled_ns = self._clock.now_ns()
        except SilentError as error:
            # An old sample says so itself; a board that is gone for good is another matter.
            age_ns = device.age_ns(self._clock.now_ns())
            if age_ns is None or age_ns > 10 * self._max_age_ns:
                self._latch(cause := f"has fallen silent: {told(error, _NAME)}")
                raise DeviceError(_NAME, cause) from error
        except DriverError as error:
            self._latch(str(error))
            raise translated(error, _NAME) from error
        return device

    def _look_for_news(self, device: Jr3) -> None:
        """After a long pause: what waited in the line may be as old as the pause, so wait for one reading more."""
        waiting = None if device.latest is None else device.latest.sequence
        deadline_ns = self._clock.now_ns() + 3 * self._settings.period_us * 1000 + _LINE_NS
        while self._clock.now_ns() < deadline_ns:
            self._sleep(0.001)
            device.poll(self._clock.now_ns())
            device.check()
            if device.latest is not None and device.latest.sequence != waiting:
                self._undated = None
                return
        self._undated = waiting

    def _made(self, sample: Jr3Sample) -> WrenchSample:
        validity = Validity.VALID
        if sample.settling:
            validity = Validity.INVALID
        elif sample.sequence == self._undated:
            validity = Validity.STALE
        elif self._clock.now_ns() - sample.receive_time_ns > self._max_age_ns:
            validity = Validity.STALE
        elif sample.saturated or sample.near_saturated:
            validity = Validity.SATURATED
        time_ns = sample.receive_time_ns
        return WrenchSample(sample.force_N, sample.torque_Nm, time_ns, time_ns, sample.sequence, validity)

    def _fail(self, problem: str) -> None:
        self._latch(problem)
        raise DeviceError(_NAME, problem)

    def _on_configure(self) -> None:
        with translating(_NAME):
            self._opened = self._open_wire()
            self.device = Jr3(self._opened.wire, self._settings)
            pace = Pace(self._clock.now_ns, self._sleep)
            start_up(self.device, pace, self._start_timeout_s)

    def _on_activate(self) -> None:
        """Wait for a reading that can be used: after a start the board's filter must settle."""
        with translating(_NAME):
            device, deadline_ns = self._polled(), self._clock.now_ns() + round(self._start_timeout_s * 1e9)
            since_ns = self._clock.now_ns()
            while device.latest is None or device.latest.settling or device.latest.receive_time_ns < since_ns:
                self._sleep(0.002)
                device.poll(self._clock.now_ns())
                device.check()
                if self._clock.now_ns() > deadline_ns:
                    raise SilentError(_NAME, "delivers no settled reading", "choose a higher cut-off, or look at it")

    def _on_acknowledge(self) -> None:
        if self.device is not None:
            self.device.acknowledge()

    def _on_close(self) -> None:
        device, opened = self.device, self._opened
        self.device = self._opened = None
        try:
            if device is not None:
                wait_s = _LEAVE_S if self._is_sound(device) else _DEAD_S
                shut_down(device, Pace(self._clock.now_ns, self._sleep), wait_s)
        except DriverError:
            # It does not listen any more; what matters is that the wire is released.
            return
        finally:
            if opened is not None:
                with suppress(Exception):
                    # An adapter that is gone cannot even be told to close its bus, and says so in many ways.
                    opened.close()

    def _is_sound(self, device: Jr3) -> bool:
        """Whether it may be expected to answer."""
        device.poll(self._clock.now_ns())
        try:
            device.check()
        except DriverError:
            return False
        return self._life is not Life.FAULTED

    def _sleep(self, seconds: float) -> None:
        self._clock.sleep_until(self._clock.now_ns() + round(seconds * 1e9))


@dataclass(frozen=True)
class _Jr3Table(Settings):
    """What both wires have in common in a rig file."""

    TABLE: ClassVar[str] = "force_sensor"

    cutoff_Hz: float = 50.0
    """Cut-off of the board's filter."""
    period_us: int = 5000
    """Time between two readings."""
    axes: Annotated[str, OneOf("left-handed", "right-handed")] = "left-handed"
    """Handedness of the sensor's axes."""
    max_age_ms: Annotated[float, Range(1.0, 10_000.0)] = 50.0
    """Age above which a sample is marked as stale."""
    start_timeout_s: Annotated[float, Range(0.1, 600.0)] = 30.0
    """Longest wait for the first reading."""

    def sensor(self, open_wire: Callable[[], OpenWire], context: RigContext) -> Jr3ForceSensor:
        """The adapter."""
        signs = LEFT_HANDED if self.axes == "left-handed" else RIGHT_HANDED
        with translating("force_sensor"):
            settings = Jr3Settings(self.cutoff_Hz, self.period_us, signs)
        age_ns = round(self.max_age_ms * 1e6)
        return Jr3ForceSensor(
            open_wire, settings, context.clock, max_age_ns=age_ns, start_timeout_s=self.start_timeout_s
        )


@dataclass(frozen=True)
class _CanTable(_Jr3Table, CanBusTable):
    node: int = 1
    """The board's node."""
    canopen_nodes: tuple[int, ...] = ()
    """CANopen nodes on the same bus."""


@dataclass(frozen=True)
class _UartTable(_Jr3Table):
    port: str = "/dev/ttyUSB0"
    """Serial port."""
    baud: int = 115_200
    """Its rate."""


def jr3_can_table(settings: DeviceSettings) -> _CanTable:
    """The table ``[force_sensor]`` of a JR3 on CAN with all that it leaves out.

    Raises:
        ConfigurationError: Something in it cannot be used.
    """
    return overlay(_CanTable(), settings)


def jr3_uart_table(settings: DeviceSettings) -> _UartTable:
    """The same of a JR3 on a serial line.

    Raises:
        ConfigurationError: Something in it cannot be used.
    """
    return overlay(_UartTable(), settings)


def make_jr3_can(settings: DeviceSettings, context: RigContext) -> Jr3ForceSensor:
    """A JR3 on CAN, of the table ``[force_sensor]`` of a rig file."""
    table = jr3_can_table(settings)
    return table.sensor(lambda: open_can_wire(table), context)


def make_jr3_uart(settings: DeviceSettings, context: RigContext) -> Jr3ForceSensor:
    """A JR3 on a serial line, of the table ``[force_sensor]`` of a rig file."""
    table = jr3_uart_table(settings)
    return table.sensor(lambda: open_uart_wire(table), context)


def open_can_wire(table: _CanTable) -> OpenWire:
    """Open the bus.

    Raises:
        WiringError: It cannot be opened.
    """
    # We only ever ask whether something is there; slcan would wait a millisecond for it.
    extra: dict[str, Any] = {"timeout": 0.0} if table.bus["interface"] == "slcan" else {}
    bus = open_bus(**(extra | table.bus))
    return OpenWire(CanTransport(CanLink(bus), table.node, table.canopen_nodes), bus.shutdown)


def open_uart_wire(table: _UartTable) -> OpenWire:
    """Open the port.

    Raises:
        WiringError: It cannot be opened.
    """
    port = open_serial(table.port, table.baud, _NAME)
    return OpenWire(UartTransport(UartLink(port)), lambda: close_serial(port))
