"""Driver for the arm. It checks the arm when opening it, commands it in every cycle, and stops it on any error.

A stop brakes with servoStop. If set-points or the client process are missing, the controller's watchdog ends the
control program, which also brakes the arm.
"""

from collections.abc import Callable, Sequence
from typing import Final

from typing_extensions import override

from palpate.drivers.device import ArmState, LatchingArm, Measured, clamped, held_back, require_angles
from palpate.drivers.errors import DeviceFaultError, DriverError, LateError, SettingError, SilentError, WiringError
from palpate.drivers.ur.link import CHECK, KEEP_TIME, NAME, UrHello, UrLink, UrState
from palpate.drivers.ur.settings import (
    PROTECTIVE_STOP,
    UrSettings,
    require_ready,
    require_sense,
    require_setpoints,
    require_version,
)

JOINTS: Final = 6
_OPEN_S, _ANSWER_S, _PROGRAM_S, _STOP_S = 3.0, 1.0, 6.0, 0.5
_STOP_RAD_S2: Final = 15.0
_WAIT_S: Final = 0.02


class UrArm(LatchingArm):
    """A Universal Robots arm.

    Attributes:
        hello: The controller's identity, or None before :meth:`open`.
        tcp_offset: Tool centre point relative to the flange: metres and rotation vector, (6,); empty unless open.
    """

    def __init__(
        self, link: UrLink, settings: UrSettings, *, now_ns: Callable[[], int], sleep: Callable[[float], None]
    ) -> None:
        super().__init__()
        self.settings = settings
        self.hello: UrHello | None = None
        self.tcp_offset: tuple[float, ...] = ()
        self._link, self._now_ns, self._sleep = link, now_ns, sleep
        self._seen: UrState | None = None
        self._force_N: tuple[float, ...] | None = None
        self._cycled_ns = 0

    def open(self) -> None:
        """Connect to the controller without moving the arm."""
        self._require("open()", ArmState.NEW)
        seen = self._reach()
        try:
            self._judge_controller(seen)
        except (DeviceFaultError, WiringError) as error:
            # No run has started: the fault is from an earlier use of the rig.
            raise SettingError(error.device, error.problem, error.remedy) from error
        self._ask_tcp()
        self._state = ArmState.CONFIGURED

    @property
    def seen(self) -> UrState | None:
        """Latest state, or None before :meth:`open`."""
        return self._seen

    def enable(self) -> None:
        """Start the control program with the controller's watchdog, without motion. Also restores a lost connection."""
        self._require("enable()", ArmState.CONFIGURED)
        try:
            seen = self._fresh()
            self._judge_controller(seen)
        except DeviceFaultError as error:
            self._fail(error)
            raise
        except (SilentError, WiringError):
            # The arm was idle, so the connection is restored.
            seen = self._reach()
            self._judge_controller(seen)
            self._ask_tcp()
        for i, (angle, low, high) in enumerate(
            zip(seen.q_rad, self.settings.lower_rad, self.settings.upper_rad, strict=True)
        ):
            if not low <= angle <= high:
                problem = f"joint {i + 1} is at {angle:.4f} rad, outside {low:.4f} to {high:.4f}"
                raise SettingError(NAME, problem, "move it back from the pendant")
        self._link.call("control", _PROGRAM_S, 1.0 / self.settings.watchdog_s)
        seen = self._fresh()
        self.setpoint_rad, self._force_N = seen.q_rad, seen.wrench[:3]
        self._cycled_ns = self._now_ns()
        self._state = ArmState.ENABLED

    def cycle(self, setpoint_rad: Sequence[float] | None = None, /) -> Measured:
        """Send a set-point and check the latest state; None holds the position."""
        self._require("cycle()", ArmState.CONFIGURED, ArmState.ENABLED, ArmState.STOPPED)
        enabled, before, settings = self._state is ArmState.ENABLED, self._seen, self.settings
        if setpoint_rad is not None:
            self._require("a set-point", ArmState.ENABLED, ArmState.STOPPED)
            within = clamped(require_angles(setpoint_rad, JOINTS), settings.lower_rad, settings.upper_rad)
            if enabled:
                most_rad = [speed * settings.period_s for speed in settings.velocity_rad_s]
                self.setpoint_rad = held_back(within, self.setpoint_rad, most_rad)
        away_s, self._cycled_ns = (self._now_ns() - self._cycled_ns) * 1e-9, self._now_ns()
        with self._latching():
            if enabled:
                self._link.servo(self.setpoint_rad, settings.period_s, settings.lookahead_s, settings.gain)
            try:
                seen = self._fresh()
            except SilentError as error:
                if enabled and away_s > settings.silence_s:
                    problem = f"this computer was away for {away_s * 1e3:.0f} ms; after that {error.problem}"
                    raise LateError(NAME, problem, KEEP_TIME) from error
                if self._state is not ArmState.STOPPED or before is None:
                    raise
                # The arm is stationary; the next enable() restores the connection.
                seen = before
            if enabled:
                require_setpoints(seen, self._force_N, settings.force_stop_N, self._link.host)
            elif self._state is ArmState.STOPPED:
                require_ready(seen, self._link.host)
        return Measured(seen.q_rad, self._now_ns() - max(0, self._link.stamp_ns() - seen.stamp_ns))

    @override
    def diagnostics(self) -> dict[str, str]:
        found = super().diagnostics()
        if self.hello is not None:
            found["controller"] = f"PolyScope {self.hello.version}, robot {self.hello.serial}"
        if self._seen is not None:
            found["newest data"] = f"{self._age_s(self._seen) * 1e3:.0f} ms old"
            found["payload"] = f"{self._seen.payload_kg:g} kg at {self._seen.payload_cog_m} m from the flange"
        found["tool centre point"] = f"{self.tcp_offset} from the flange, m and rad"
        return found

    def stop(self) -> None:
        """Brake the arm; a client that does not respond is terminated, so that the controller's watchdog acts."""
        if self._state is ArmState.ENABLED:
            self._state = ArmState.STOPPED
        elif self._state is not ArmState.FAULTED:
            return
        try:
            self._link.call("stop", _STOP_S, _STOP_RAD_S2)
        except DriverError:
            self._link.close()

    def acknowledge(self) -> None:
        """Unlock a protective stop, or restore a broken connection. Only a person may decide to do this."""
        self._require_fault()
        try:
            seen = self._fresh()
        except DriverError:
            seen = self._reach()
        if seen.safety_mode == PROTECTIVE_STOP:
            self._link.call("unlock", _ANSWER_S)
            self._sleep(0.1)
            seen = self._fresh()
        self._judge_controller(seen)
        self._state, self.fault = ArmState.CONFIGURED, None

    def close(self) -> None:
        """Stop the arm, and end the program and the client. Never raises."""
        self.stop()
        self._link.close()
        self._state = ArmState.CLOSED

    def _reach(self) -> UrState:
        self._seen = None
        self.hello = self._link.open(_OPEN_S)
        require_version(self.hello, self._link.host)
        return self._fresh()

    def _fresh(self) -> UrState:
        """Return the latest state, after a short wait if necessary."""
        waited_s, before = 0.0, self._seen
        while True:
            seen = self._link.state()
            if seen is not None and (before is None or seen.timestamp_s != before.timestamp_s):
                require_sense(seen, before, self._link.host)
                self._seen = seen
                if self._age_s(seen) < _WAIT_S:
                    return seen
            if waited_s >= (_OPEN_S if before is None else _WAIT_S):
                break
            self._sleep(0.001)
            waited_s += 0.001
        if seen is None or self._age_s(seen) > self.settings.silence_s:
            silence = "ever" if seen is None else f"for {self._age_s(seen) * 1e3:.0f} ms"
            raise SilentError(NAME, f"its controller at {self._link.host} has sent no data {silence}", CHECK)
        return seen

    def _age_s(self, seen: UrState) -> float:
        return (self._link.stamp_ns() - seen.stamp_ns) * 1e-9

    def _judge_controller(self, seen: UrState) -> None:
        require_ready(seen, self._link.host)
        if not self._link.call("remote", _ANSWER_S):
            problem = f"its controller at {self._link.host} is in local control"
            raise WiringError(NAME, problem, "switch the pendant to remote control")

    def _ask_tcp(self) -> None:
        # Only the control program provides the tool centre point.
        self._link.call("control", _PROGRAM_S, 0.0)
        self.tcp_offset = tuple(self._link.call("tcp", _ANSWER_S))
