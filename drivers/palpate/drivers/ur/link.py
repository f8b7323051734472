"""Connection to the process that runs ur_rtde. Every wait has a time limit."""

import json
import select
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, Final

from palpate.drivers.errors import DriverError, SettingError, SilentError, WiringError
from palpate.drivers.ur.process_main import STATE

NAME: Final = "Universal Robots arm"
CHECK: Final = "check the address in the rig file, the cable, and that the controller is switched on"
KEEP_TIME: Final = "end other programs, take --real-time.scheduling, or a larger [arm] timeout_scale"
EXTRA: Final = "pip install 'palpate[ur]'"
_MOST: Final = 1 << 16
_END_S: Final = 0.2


@dataclass(frozen=True, slots=True)
class UrHello:
    """The controller's identity."""

    version: str
    serial: str


@dataclass(frozen=True, slots=True)
class UrState:
    """A data package from the controller.

    Attributes:
        stamp_ns: Reception time on the clock read by :meth:`UrLink.stamp_ns`.
        q_rad: Joint angles, (6,).
        wrench: Raw force and torque in the tool flange, (6,) N and N m, including the tool's weight.
        payload_cog_m: The payload's centre of gravity relative to the flange, (3,).
        tcp_pose: Tool centre point in the controller's base frame, (6,): position in metres and rotation vector.
    """

    stamp_ns: int
    timestamp_s: float
    q_rad: tuple[float, ...]
    wrench: tuple[float, ...]
    robot_mode: int
    safety_mode: int
    runtime: int
    payload_kg: float
    payload_cog_m: tuple[float, ...]
    tcp_pose: tuple[float, ...]


class UrLink:
    """Connection to the controller through ur_rtde in a separate process.

    Args:
        set_priority: Function that gives the calling thread real-time priority, which the process inherits.
        real_time_factor: Controller seconds per real second; below 1 for an emulated controller.
    """

    def __init__(
        self,
        host: str,
        rate_Hz: float,
        set_priority: Callable[[], object] = lambda: None,
        real_time_factor: float = 1.0,
    ) -> None:
        self._real_time_factor = real_time_factor
        self.host, self._words, self._set_priority = host, [host, str(rate_Hz)], set_priority
        self._process: subprocess.Popen[bytes] | None = None
        self._line: socket.socket | None = None
        self._errors: Any = None
        self._state, self._requested = b"", 0
        self._answers: dict[int, dict[str, Any]] = {}
        self._lost = ""

    def stamp_ns(self) -> int:
        """Return the time on the clock used for states: the monotonic system clock, scaled by ``real_time_factor``."""
        return round(time.monotonic_ns() * self._real_time_factor)

    def open(self, timeout_s: float) -> UrHello:
        """Connect to the controller; an earlier connection is closed.

        Raises:
            DriverError: The controller is missing or does not answer in time.
        """
        if find_spec("rtde_control") is None:
            raise SettingError(NAME, "the package ur_rtde is not installed", EXTRA)
        self.close()
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        # The client prints its errors.
        self._errors = tempfile.TemporaryFile()
        with theirs:
            # A process inherits from the thread that starts it, and this thread must not change.
            starter = threading.Thread(target=self._start, args=(theirs.fileno(),))
            starter.start()
            starter.join()
        self._line, self._state, self._lost = ours, b"", ""
        hello = UrHello(**self.call("hello", timeout_s))
        self.call("listen", timeout_s)
        return hello

    def call(self, request: str, timeout_s: float, *args: float) -> Any:
        """Send a request and wait for the reply.

        Raises:
            DriverError: The request was rejected, or was not answered in time. A time-out closes the link.
        """
        self._requested += 1
        number, deadline_ns = self._requested, time.monotonic_ns() + round(timeout_s * 1e9)
        self._send({"op": request, "id": number, "args": args})
        while number not in self._answers:
            left_s = (deadline_ns - time.monotonic_ns()) * 1e-9
            if left_s <= 0.0:
                self.close()
                problem = f"{self.host} has not answered within {timeout_s:g} s ({request})"
                raise SilentError(NAME, problem, CHECK)
            select.select([self._open_line()], [], [], left_s)
            self._take()
        answer = self._answers.pop(number)
        if "error" in answer:
            raise WiringError(NAME, f"{self.host} ({request}): {answer['error']}", CHECK)
        return answer["value"]

    def servo(self, q_rad: tuple[float, ...], step_s: float, lookahead_s: float, gain: float) -> None:
        """Send a set-point without waiting.

        Raises:
            DriverError: The connection to the controller is lost.
        """
        # ur_rtde requires a speed and an acceleration, which servoj does not use.
        self._send({"op": "servo", "args": [list(q_rad), 0.5, 0.5, step_s, lookahead_s, gain]})

    def state(self) -> UrState | None:
        """Return the latest state, or None before the first.

        Raises:
            DriverError: The connection to the controller is lost.
        """
        self._take()
        if not self._state:
            return None
        fields: dict[str, Any] = json.loads(self._state)
        fields |= {name: tuple(value) for name, value in fields.items() if isinstance(value, list)}
        fields["stamp_ns"] = round(fields["stamp_ns"] * self._real_time_factor)
        return UrState(**fields)

    def close(self) -> None:
        """Instruct the controller to end its program, then end the process. Never raises."""
        process, line, errors = self._process, self._line, self._errors
        self._process = self._line = self._errors = None
        self._answers = {}
        if line is not None:
            line.close()
        if process is not None:
            with suppress(subprocess.TimeoutExpired):
                process.wait(_END_S)
            process.kill()
            process.wait()
        if errors is not None:
            errors.close()

    def _start(self, fd: int) -> None:
        self._set_priority()
        self._process = subprocess.Popen(
            [sys.executable, "-m", "palpate.drivers.ur.process_main", str(fd), *self._words], pass_fds=[fd],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=self._errors, start_new_session=True,
        )  # fmt: skip

    def _open_line(self) -> socket.socket:
        if self._line is None:
            raise SilentError(NAME, f"the connection to {self.host} is closed", CHECK)
        return self._line

    def _send(self, message: dict[str, Any]) -> None:
        try:
            self._open_line().send(json.dumps(message).encode(), socket.MSG_DONTWAIT)
        except BlockingIOError as error:
            problem = f"the client takes no set-points: {self.host} does not answer it"
            raise SilentError(NAME, problem, CHECK) from error
        except OSError as error:
            # The last message of the process is more informative than the broken connection.
            with suppress(OSError):
                self._take()
            raise self._gone() from error

    def _take(self) -> None:
        line = self._open_line()
        while True:
            try:
                message = line.recv(_MOST, socket.MSG_DONTWAIT)
            except BlockingIOError:
                break
            except OSError as error:
                raise self._gone() from error
            if not message:
                raise self._gone()
            if message.startswith(STATE):
                self._state = message[1:]
            elif "lost" in (heard := json.loads(message)):
                self._lost = heard["lost"]
                raise self._gone()
            else:
                self._answers[heard["id"]] = heard

    def _gone(self) -> DriverError:
        cause = self._lost or self._last_words() or "the client's process has ended"
        return SilentError(NAME, f"the connection to {self.host} is broken: {cause}", CHECK)

    def _last_words(self) -> str:
        self._errors.seek(0)
        lines = self._errors.read().decode("utf-8", "replace").strip().splitlines()
        return lines[-1].strip() if lines else ""
