"""Emulated CAN nodes on python-can's virtual bus."""

import time
from collections.abc import Callable

import can

from palpate.simulation.emulators.lines.can_bus import BusFrame, EmulatedCanBus
from palpate.simulation.emulators.lines.can_bus_server import CanBusServer, DEFAULT_TICK_s


class VirtualBusServer(CanBusServer):
    """Serves a channel of python-can's virtual interface, for drivers in the same process.

    Names of channels are global in the process, so take a fresh one for each bus.
    """

    def __init__(
        self,
        wire: EmulatedCanBus,
        channel: str,
        *,
        tick_s: float = DEFAULT_TICK_s,
        clock_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        super().__init__(wire, tick_s=tick_s, clock_ns=clock_ns)
        self.channel = channel
        self._bus = can.Bus(interface="virtual", channel=channel)

    def _receive(self, timeout_s: float) -> list[BusFrame]:
        frames: list[BusFrame] = []
        message = self._bus.recv(timeout_s)
        while message is not None:
            if not (message.is_extended_id or message.is_remote_frame or message.is_error_frame):
                frames.append(BusFrame(message.arbitration_id, bytes(message.data)))
            message = self._bus.recv(0.0)
        return frames

    def _transmit(self, frames: list[BusFrame]) -> None:
        for frame in frames:
            self._bus.send(can.Message(arbitration_id=frame.arbitration_id, data=frame.data, is_extended_id=False))

    def _release(self) -> None:
        self._bus.shutdown()
