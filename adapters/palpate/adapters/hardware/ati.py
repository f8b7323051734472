"""The driver of ATI's Net F/T as a force sensor: wiring and marks, nothing else."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Annotated, ClassVar, Final

from typing_extensions import override

from palpate.adapters.config import SensorFactsTable, overlay
from palpate.adapters.hardware.lateness import LATE_NS
from palpate.adapters.hardware.plugins import DeviceSettings, Host, RigContext
from palpate.adapters.hardware.polled_sensor import PolledForceSensor
from palpate.core.ports import Clock, Range, Settings
from palpate.drivers.ati import PAGE, RDT_PORT, NetFt, NetFtBox, UdpWire, fetch_page, parse_box, scaling
from palpate.drivers.errors import DriverError

_NAME: Final = "ATI Net F/T"
_PAGE_S: Final = 3.0
"""Longest wait for the box's page."""
_PAGE_NS: Final = 1_000_000_000


@dataclass(frozen=True)
class OpenBox:
    """A way to the box, open.

    Attributes:
        again: Have its page read once more, by somebody else.
    """

    wire: UdpWire
    box: NetFtBox
    close: Callable[[], None]
    again: Callable[[], Future[bytes]]


class NetFtForceSensor(PolledForceSensor[NetFt]):
    """A wrist sensor behind a Net F/T box; its frame is the box's own."""

    REMEDY = "end other programs that ask the box for its stream, and let UDP through this computer's firewall"

    def __init__(
        self,
        open_box: Callable[[], OpenBox],
        clock: Clock,
        *,
        max_age_ns: int,
        start_timeout_s: float = 5.0,
        max_late_ns: int = LATE_NS,
        page_ns: int = _PAGE_NS,
    ) -> None:
        super().__init__(_NAME, clock, max_age_ns=max_age_ns, start_timeout_s=start_timeout_s, max_late_ns=max_late_ns)
        self._open_box = open_box
        self._again: Callable[[], Future[bytes]]
        self._page_ns, self._due_ns = page_ns, 0
        self._asked = Future[bytes]()

    @property
    @override
    def period_ns(self) -> int:
        return round(1e9 / self.opened().box.rate_Hz)

    def reported_facts(self) -> SensorFactsTable:
        """Rated ranges and rate, as the box states them. It does not state its noise."""
        box = self.opened().box
        return SensorFactsTable(range_N=box.range_N, range_Nm=box.range_Nm, rate_Hz=box.rate_Hz, frame="sensor")

    @override
    def _connect(self) -> None:
        opened = self._open_box()
        self._close_wire, self.device = opened.close, NetFt(opened.wire, opened.box)
        self._again, self._asked, self._due_ns = opened.again, Future(), 0

    @override
    def _surprise(self, device: NetFt) -> str | None:
        if self._page_ns and self._polled_ns >= self._due_ns:
            self._asked, self._due_ns = self._again(), self._polled_ns + self._page_ns
        if not self._asked.done():
            return None
        asked, self._asked, then = self._asked, Future(), device.box.scaling
        try:
            now = scaling(asked.result())
        except DriverError:
            # Whether the box is there its records show; its pages are for people, too.
            return None
        changed = [
            f"{what} {now[what]} instead of {then[what]}" for what in now if now[what] != then.get(what, now[what])
        ]
        if not changed:
            return None
        return f"another client has set it anew: {', '.join(changed)}; set it back on its pages, then acknowledge"

    @override
    def _on_activate(self) -> None:
        self.opened().start(self._clock.now_ns())
        super()._on_activate()

    def _on_deactivate(self) -> None:
        self.opened().stop()

    @override
    def _leave(self, device: NetFt) -> None:
        device.stop()


@dataclass(frozen=True)
class NetFtTable(Settings):
    """A Net F/T in a rig file."""

    TABLE: ClassVar[str] = "force_sensor"

    host: Host = "192.168.1.1"
    """Address of the box."""
    port: Annotated[int, Range(1, 65535)] = RDT_PORT
    """Its UDP port."""
    http_port: Annotated[int, Range(1, 65535)] = 80
    """Port of its web server."""
    max_age_ms: Annotated[float, Range(1.0, 10_000.0)] = 50.0
    """Age above which a sample is marked as stale."""
    max_late_ms: Annotated[float, Range(0.0, 10_000.0)] = LATE_NS * 1e-6
    """Records that come by more than this later than they did, by the box's own count, are a fault; 0 asks for none."""
    page_every_s: Annotated[float, Range(0.0, 3600.0)] = _PAGE_NS * 1e-9
    """How often its page is read again while it streams, for what other clients set; 0 is never."""
    start_timeout_s: Annotated[float, Range(0.1, 600.0)] = 5.0
    """Longest wait for the first reading."""


def make_ati_netft(settings: DeviceSettings, context: RigContext) -> NetFtForceSensor:
    """A Net F/T, of the table ``[force_sensor]`` of a rig file."""
    table = overlay(NetFtTable(), settings)

    def page() -> bytes:
        return fetch_page(table.host, table.http_port, PAGE, _PAGE_S)

    def open_box() -> OpenBox:
        box, wire = parse_box(page()), UdpWire(table.host, table.port)
        beside = ThreadPoolExecutor(1, "net-ft-page")

        def close() -> None:
            beside.shutdown(wait=False, cancel_futures=True)
            wire.close()

        return OpenBox(wire, box, close, lambda: beside.submit(page))

    return NetFtForceSensor(
        open_box, context.clock, max_age_ns=round(table.max_age_ms * 1e6), start_timeout_s=table.start_timeout_s,
        max_late_ns=round(table.max_late_ms * 1e6), page_ns=round(table.page_every_s * 1e9),
    )  # fmt: skip
