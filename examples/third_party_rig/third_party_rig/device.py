"""What both devices have in common: the link, its end, its renewal, and samples that age."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NoReturn

from palpate.core.errors import ConfigurationError, DeviceError
from palpate.core.ports import Clock, ManagedDevice, Validity
from third_party_rig.link import DeviceClock, Link, Reading, reading

MAX_AGE_NS = 50_000_000
"""Older samples are marked as stale."""
DEAD_NS = 200_000_000
"""A device that has been silent for so long is gone, whatever the connection seems to be."""


class BenchDevice(ManagedDevice):
    """A device at the end of a link.

    Args:
        kind: What it calls itself.
        channels: Numbers in a sample.
        address: Host and port.
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
        """Whether it holds a connection: what the contract's knob of this name asks."""
        return self._link is not None

    def _take_in(self) -> Validity:
        """Read what has come, keep the newest, and say what it is worth.

        Raises:
            DeviceError: The link is dead, which is latched.
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
        """The link is made anew. The device may have been switched off meanwhile: its clock and numbers begin anew."""
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
        """Never raises: where the cable is cut, the device holds by itself."""
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
    """Host and port of a device's table in a rig file.

    Raises:
        ConfigurationError: One of them cannot be used, or there is something else.
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
