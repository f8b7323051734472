"""The process that runs ur_rtde: ``python -m palpate.drivers.ur.process_main FD HOST RATE_HZ``.

It stops the arm and ends when the other side disconnects. Without set-points, or if this process hangs or dies, the
controller's own watchdog ends the control program.
"""

import json
import os
import select
import socket
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, Final

STATE: Final = b"S"
_LOOK_S: Final = 0.001
_START_S: Final = 2.0
_MOST: Final = 1 << 16
_VARIABLES: Final = [
    "timestamp", "actual_q", "ft_raw_wrench", "robot_mode", "safety_mode", "runtime_state", "payload", "payload_cog",
    "actual_TCP_pose",
]  # fmt: skip


class Served:
    """The ur_rtde client and the code that executes requests."""

    def __init__(self, line: socket.socket, host: str, rate_Hz: float) -> None:
        self._line, self._host, self._rate_Hz = line, host, rate_Hz
        self._dashboard: Any = None
        self._receive: Any = None
        self._control: Any = None
        self._timestamp_s, self._priority = -1.0, os.sched_getparam(0).sched_priority
        self._has_setpoints = False
        self._ways: dict[str, Callable[..., Any]] = {
            "hello": self._hello, "listen": self._listen, "control": self._start_program, "stop": self._stop,
            "tcp": lambda: self._control.getTCPOffset(), "unlock": self._unlock,
            "remote": lambda: self._dashboard.isInRemoteControl(),
        }  # fmt: skip

    def serve(self) -> None:
        """Serve until the other side or the controller disconnects."""
        while True:
            # The client does not signal new data; before the first, the process waits only for requests.
            look_s = None if self._receive is None else _LOOK_S
            if select.select([self._line], [], [], look_s)[0] and not self._hear():
                return
            if self._receive is not None:
                self._notify_state()

    def end(self) -> None:
        """Stop the arm and end the program, if one is running."""
        with suppress(Exception):
            if self._control is not None:
                if self._has_setpoints:
                    self._stop(20.0)
                self._control.stopScript()

    def _hear(self) -> bool:
        """Execute requests and only the latest set-point; return False if the other side has disconnected."""
        joints_rad = None
        while True:
            try:
                message = self._line.recv(_MOST, socket.MSG_DONTWAIT)
            except BlockingIOError:
                break
            if not message:
                return False
            requested = json.loads(message)
            if requested["op"] == "servo":
                joints_rad = requested["args"]
                continue
            joints_rad = None
            self._answer(requested)
        if joints_rad is not None and self._control is not None:
            self._has_setpoints = True
            self._control.servoJ(*joints_rad)
        return True

    def _answer(self, requested: dict[str, Any]) -> None:
        try:
            answer = {"id": requested["id"], "value": self._ways[requested["op"]](*requested["args"])}
        except Exception as error:
            # The text of any error from the client is passed on unchanged.
            answer = {"id": requested["id"], "error": str(error).strip() or repr(error)}
        self._line.send(json.dumps(answer).encode())

    @contextmanager
    def _ahead(self) -> Iterator[None]:
        """Let the client start threads with a higher priority than the calling thread, which polls without sleeping."""
        policy, own = os.sched_getscheduler(0), self._priority
        if own > 1:
            os.sched_setscheduler(0, policy, os.sched_param(own))
        try:
            yield
        finally:
            if own > 1:
                os.sched_setscheduler(0, policy, os.sched_param(own - 1))

    def _hello(self) -> dict[str, Any]:
        from dashboard_client import DashboardClient  # type: ignore[import-untyped, import-not-found, unused-ignore]

        self._dashboard = DashboardClient(self._host)
        self._dashboard.connect(1000)
        version = self._dashboard.polyscopeVersion()
        with suppress(Exception):
            return {"version": version, "serial": self._dashboard.getSerialNumber()}
        return {"version": version, "serial": ""}

    def _listen(self) -> None:
        from rtde_receive import RTDEReceiveInterface  # type: ignore[import-untyped, import-not-found, unused-ignore]

        with self._ahead():
            self._receive = RTDEReceiveInterface(self._host, self._rate_Hz, _VARIABLES)

    def _start_program(self, watchdog_Hz: float) -> bool:
        from rtde_control import RTDEControlInterface  # type: ignore[import-untyped, import-not-found, unused-ignore]

        self._has_setpoints = False
        if self._control is None:
            with self._ahead():
                self._control = RTDEControlInterface(self._host, self._rate_Hz)
        else:
            self._control.reuploadScript()
            deadline_s = time.monotonic() + _START_S
            while not self._control.isProgramRunning():
                if time.monotonic() > deadline_s:
                    raise RuntimeError("the control program does not start")
                time.sleep(0.005)
        return bool(self._control.setWatchdog(watchdog_Hz)) if watchdog_Hz else True

    def _stop(self, rad_s2: float) -> bool:
        self._has_setpoints = False
        return self._control is None or bool(self._control.servoStop(rad_s2))

    def _unlock(self) -> None:
        self._dashboard.closeSafetyPopup()
        self._dashboard.unlockProtectiveStop()

    def _notify_state(self) -> None:
        receive = self._receive
        if not receive.isConnected():
            raise ConnectionError("the controller has closed the RTDE connection, or sends nothing any more")
        timestamp_s = receive.getTimestamp()
        if timestamp_s == self._timestamp_s:
            return
        state = {
            "stamp_ns": time.monotonic_ns(), "timestamp_s": timestamp_s, "q_rad": receive.getActualQ(),
            "wrench": receive.getFtRawWrench(), "robot_mode": receive.getRobotMode(),
            "safety_mode": receive.getSafetyMode(), "runtime": receive.getRuntimeState(),
            "payload_kg": receive.getPayload(), "payload_cog_m": receive.getPayloadCog(),
            "tcp_pose": receive.getActualTCPPose(),
        }  # fmt: skip
        if receive.getTimestamp() != timestamp_s:
            # A package has arrived in the meantime, so the parts would be from different times.
            return
        self._timestamp_s = timestamp_s
        with suppress(BlockingIOError):
            self._line.send(STATE + json.dumps(state).encode(), socket.MSG_DONTWAIT)


def main() -> None:
    """Serve, then exit without returning and without the client's own clean-up, which may wait indefinitely."""
    fd, host, rate_Hz = sys.argv[1:]
    with suppress(OSError):
        # The client polls without sleeping, so it must not run on a processor reserved for the loop.
        os.sched_setaffinity(0, range(os.cpu_count() or 1))
    line = socket.socket(fileno=int(fd))
    served = Served(line, host, float(rate_Hz))
    try:
        served.serve()
    except Exception as error:
        with suppress(OSError):
            line.send(json.dumps({"lost": str(error).strip() or repr(error)}).encode())
    line.close()
    served.end()
    os._exit(0)


if __name__ == "__main__":
    main()
