"""Starts the process that hosts an arm, and is that process."""

import mmap
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any, Final, NamedTuple

from typing_extensions import override

from palpate.adapters.config import RealTimeConfig
from palpate.adapters.hardware.bus_process.host import Host, HostedPair
from palpate.adapters.hardware.bus_process.hosted import ArmProcess, HostedArm
from palpate.adapters.hardware.bus_process.wire import Board, Wire
from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.plugins import RigContext, arm_maker
from palpate.adapters.hardware.real_time import RealTime, take_real_time
from palpate.adapters.signals import ignore_ending_signals
from palpate.core.errors import DeviceError
from palpate.core.job import ToolConfig
from palpate.core.motion import ArmDescription
from palpate.core.ports import JointVector

_END_S: Final = 12.0
"""Longest wait for the process to end: what it takes to stop and close an arm whose line is dead, twice over."""
_SWITCH_S: Final = 0.0001


class _Assignment(NamedTuple):
    """All that the process has to be told; the first message on the wire."""

    adapter: str
    settings: dict[str, Any]
    origin_ns: int
    arm: ArmDescription
    limits: tuple[JointVector, JointVector, JointVector]
    tool: ToolConfig | None
    accept_kinematics: bool
    real_time: RealTimeConfig
    deadman_ns: int


class _StartedProcess(ArmProcess):
    """The process, just started. It works once it has got its assignment."""

    def __init__(self, assignment: _Assignment, clock: MonotonicClock) -> None:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        memory = os.memfd_create("palpate arm")
        handed = (theirs.fileno(), memory)
        words = ["-P", "-m", "palpate.adapters.hardware.bus_process.process", *map(str, handed)]
        try:
            os.ftruncate(memory, Board.BYTES)
            # In a process group of its own: Ctrl-C and Ctrl-Z are for the loop, and this stops the arm after both.
            self._process = subprocess.Popen(
                [sys.executable, *words], stdin=subprocess.DEVNULL, pass_fds=handed, process_group=0
            )
            self.board = Board(mmap.mmap(memory, Board.BYTES))
        except OSError as error:
            ours.close()
            raise DeviceError("arm", f"its process cannot be started ({error.strerror})") from error
        finally:
            theirs.close()
            os.close(memory)
        self.wire = Wire(ours, clock)
        with suppress(EOFError):
            self.wire.put(assignment)

    @override
    def obituary(self) -> str:
        with suppress(subprocess.TimeoutExpired):
            code = self._process.wait(0.05)
            return f"was killed by {signal.Signals(-code).name}" if code < 0 else f"has ended with code {code}"
        return "has hung up"

    @override
    def end(self) -> None:
        self.wire.close()
        try:
            self._process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def host_arm(
    adapter: str,
    settings: Mapping[str, Any],
    context: RigContext,
    clock: MonotonicClock,
    *,
    real_time: RealTimeConfig,
    deadman_ns: int,
) -> HostedArm:
    """The arm of that name in a process of its own, which begins with ``configure``.

    Args:
        clock: The same clock as the context's.
        real_time: What the run asks of the system; the process asks for the same, with a priority above the loop's.
        deadman_ns: Time without a set-point after which the process brings the arm to rest.

    Raises:
        ConfigurationError: There is no such adapter, or it refuses its settings.
    """
    # Made here as well, which opens nothing: so what is wrong in a rig file is told before anything starts.
    name = str(getattr(arm_maker(adapter)(settings, context).arm, "name", "arm"))
    limits = (context.lower_rad, context.upper_rad, context.velocity_limit_rad_s)
    own = context.tool, context.accept_kinematics
    assignment = _Assignment(adapter, dict(settings), clock.origin_ns, context.arm, limits, *own, real_time, deadman_ns)
    return HostedArm(name, lambda: _StartedProcess(assignment, clock), clock, deadman_ns)


def _hurrying(real_time: RealTimeConfig) -> Callable[[], object]:
    """Puts a thread into the real-time class, if the run is to be there: above a loop that hangs in it."""
    if not real_time.scheduling:
        return lambda: None

    def hurry() -> None:
        if not take_real_time(min(real_time.priority + 1, 99)).granted:
            take_real_time(real_time.priority)

    return hurry


def main() -> None:
    """Be the arm's process; arguments are the numbers of the socket and of the memory."""
    # Whoever wants an end asks the loop for it; it ends this process by ending its line.
    ignore_ending_signals()
    end, memory = socket.socket(fileno=int(sys.argv[1])), int(sys.argv[2])
    board = Board(mmap.mmap(memory, Board.BYTES))
    os.close(memory)
    clock = MonotonicClock()
    wire, loop = Wire(end, clock), os.getppid()
    was_left = True
    with suppress(EOFError):
        wire.wait(clock.now_ns() + 10**10)
        told = wire.take()
        if isinstance(told, tuple):
            was_left = _serve(_Assignment(*told), end, board, lambda: os.getppid() != loop)
    if was_left:
        with suppress(OSError):
            sys.stderr.write("palpate: the loop is gone without a word; the arm was stopped\n")
    # Not a moment longer, whatever threads an adapter has left.
    os._exit(0)


def _serve(told: _Assignment, end: socket.socket, board: Board, is_orphan: Callable[[], bool]) -> bool:
    clock = MonotonicClock(told.origin_ns)
    hurry = _hurrying(told.real_time)
    hurry()
    # Between the bus and what comes from the loop.
    sys.setswitchinterval(_SWITCH_S)
    context = RigContext(clock, told.arm, *told.limits, hurry, told.tool, told.accept_kinematics)
    pair = HostedPair(arm_maker(told.adapter)(told.settings, context))
    with RealTime(replace(told.real_time, scheduling=False, cpu=-1)):
        return Host(Wire(end, clock), board, pair, clock, told.deadman_ns, is_orphan).serve()


if __name__ == "__main__":
    main()
