"""Base class for both devices. It opens, closes and renews the link, and monitors the age of samples."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NoReturn

from palpate.core.errors import ConfigurationError, DeviceError
from palpate.core.ports import Clock, ManagedDevice, Validity
from third_party_rig.link import DeviceClock, Link, Reading, reading

MAX_AGE_NS = 50_000_000
"""Age beyond which a sample is marked as stale."""
DEAD_NS = 200_000_000
"""Time without data after which a device counts as lost, even if the connection appears to be open."""


class BenchDevice(ManagedDevice):
    """Base class of a device that is connected by a link.

    Args:
        kind: Name of the device in its greeting.
        channels: Number of values in a sample.
        address: Host and port of the device.
        clock: The run's clock.
    """

    def __init__(self, kind: str, channels: int, address: tuple[str, int], clock: Clock) -> None:
        super().__init__(kind)
        self._channels, self._address, self._clock = channels, address, clock
        self._link: Link | None = None
        self._times = DeviceClock()
        self._newest = Reading(-1, 0, ())
        self._source_ns = self._heard_ns = self._sequence = 0

    @property
    def is_open(self) -> bool:
        """Return True if there is a connection, as the contract checks require."""
        return self._link is not None

    def _take_in(self) -> Validity:
        """Read the received samples, store the latest one, and return its validity.

        Raises:
            DeviceError: The link has failed; the fault is latched.
        """
        try:
            for line in self._opened().lines():
                self._keep(line)
        except OSError as error:
            self._fail(str(error))
        now_ns = self._clock.now_ns()
        if now_ns - self._heard_ns > DEAD_NS:
            self._fail(f"silent for {(now_ns - self._heard_ns) * 1e-6:.0f} ms")
        return Validity.STALE if now_ns - self._source_ns > MAX_AGE_NS else Validity.VALID

    def _keep(self, line: str) -> None:
        new = reading(line, self._channels)
        self._heard_ns = self._clock.now_ns()
        # What is sent twice is no news.
        if new.number != self._newest.number:
            self._newest, self._sequence = new, self._sequence + 1
            self._source_ns = self._times.run_ns(new.device_ns, self._heard_ns)

    def _opened(self) -> Link:
        if self._link is None:
            raise DeviceError(self.name, "is not open")
        return self._link

    def _fail(self, problem: str) -> NoReturn:
        self._latch(problem)
        raise DeviceError(self.name, problem)

    def _on_configure(self) -> None:
        try:
            self._link = Link(*self._address, self.name, self._channels)
        except OSError as error:
            raise DeviceError(self.name, f"cannot be reached at {self._address} ({error})") from error

    def _on_acknowledge(self) -> None:
        """Reconnect. The clock and the sample numbers restart, because the device may have been switched off."""
        self._let_go()
        self._times, self._newest = DeviceClock(), Reading(-1, 0, ())
        self._on_configure()

    def _on_activate(self) -> None:
        try:
            # What waits in the line is from before the pause; a fault still holds.
            for line in self._opened().lines():
                reading(line, self._channels)
            self._opened().write("B")
            self._keep(self._opened().line())
        except OSError as error:
            self._fail(str(error))

    def _on_deactivate(self) -> None:
        self._say("E")

    def _on_close(self) -> None:
        self._say("E")
        self._let_go()

    def _say(self, line: str) -> None:
        """Send a line without raising an error. After a lost connection, the device holds its position by itself."""
        if self._link is not None:
            try:
                self._link.write(line)
            except OSError:
                return

    def _let_go(self) -> None:
        link, self._link = self._link, None
        if link is not None:
            link.close()


def address(table: str, settings: Mapping[str, Any]) -> tuple[str, int]:
    """Return the host and port from a device's table in a rig file.

    Raises:
        ConfigurationError: The host or port is invalid, or the table has another key.
    """
    for name in settings:
        if name not in ("host", "port"):
            raise ConfigurationError(f"{table}.{name}", settings[name], "host or port")
    host, port = settings.get("host"), settings.get("port")
    if not isinstance(host, str):
        raise ConfigurationError(f"{table}.host", host, "the name or address of the device")
    if not isinstance(port, int):
        raise ConfigurationError(f"{table}.port", port, "a whole number")
    return host, port
