"""An arm in a process of its own, without the process: both sides in virtual time, a thread each."""

from __future__ import annotations

import mmap
import select
import socket
import threading

from palpate.adapters.hardware.bus_process.host import PACE_NS as PACE_NS
from palpate.adapters.hardware.bus_process.host import Host, HostedPair
from palpate.adapters.hardware.bus_process.hosted import ArmProcess, HostedArm
from palpate.adapters.hardware.bus_process.wire import Board, Wire
from palpate.adapters.hardware.plugins import ArmAdapter
from tests.virtual_time import VirtualTime

LONG_NS = 3_600 * 10**9


class VirtualWire(Wire):
    """Its waits let virtual time go on."""

    def __init__(self, end: socket.socket, clock: VirtualTime) -> None:
        super().__init__(end, clock)
        self._virtual = clock

    def wait(self, until_ns: int) -> None:
        self._virtual.wait_for(self._readable, until_ns)

    def _readable(self) -> bool:
        return self._end.fileno() < 0 or bool(select.select([self._end], [], [], 0)[0])


class HostThread(ArmProcess):
    """What would be the process."""

    def __init__(self, adapter: ArmAdapter, clock: VirtualTime, deadman_ns: int) -> None:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        memory = mmap.mmap(-1, Board.BYTES)
        self.wire, self.board = VirtualWire(ours, clock), Board(memory)
        self.clock = clock
        self.host = Host(VirtualWire(theirs, clock), Board(memory), HostedPair(adapter), clock, deadman_ns)
        self.was_left: bool | None = None
        self.thread = threading.Thread(target=self.run, name="host bus", daemon=True)
        self.thread.start()

    def run(self) -> None:
        self.was_left = self.host.serve()

    def obituary(self) -> str:
        return "was killed by SIGKILL"

    def end(self) -> None:
        self.wire.close()
        self.clock.wait_for(lambda: not self.thread.is_alive(), self.clock.now_ns() + 10**10)


class Hosted:
    """The hosted arm, and the process each time that one was started."""

    def __init__(self, adapter: ArmAdapter, clock: VirtualTime, deadman_ns: int = LONG_NS) -> None:
        self.adapter, self.clock, self.deadman_ns = adapter, clock, deadman_ns
        self.started: list[HostThread] = []
        self.arm = HostedArm(str(getattr(adapter.arm, "name", "arm")), self.start, clock, deadman_ns)

    def start(self) -> HostThread:
        self.started.append(HostThread(self.adapter, self.clock, self.deadman_ns))
        return self.started[-1]
