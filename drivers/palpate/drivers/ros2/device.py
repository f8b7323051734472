"""Driver for the arm. It reads joint angles, sends commands, and makes the arm hold its position on any error.

A forward_command_controller holds its last command without a time limit. Therefore each commanded position is at most
one period ahead of the arm, and each stop sends that position again, or zero velocities.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Final

from typing_extensions import override

from palpate.drivers.device import ArmState, LatchingArm, Measured, clamped, held_back, require_angles
from palpate.drivers.errors import DriverError, SettingError, SilentError
from palpate.drivers.ros2.judgement import (
    StampClock,
    await_publisher,
    joint_angles,
    require_one_publisher,
    require_subscriber,
)
from palpate.drivers.ros2.link import Ros2Link
from palpate.drivers.ros2.settings import NAME, Ros2ArmSettings

_LOOK_S: Final = 0.002
_RUN_RAD_S: Final = 0.01
_RUN_S: Final = 0.5
_WAIT_S: Final = 1.0
_STILL_RAD: Final = 0.1 * _RUN_RAD_S * 0.25 * _WAIT_S
"""Maximum motion of a stationary arm in the last quarter of the wait."""
_GAIN_PER_S: Final = 10.0
"""Additional velocity per radian of lag."""


class Ros2Arm(LatchingArm):
    """An arm that is controlled through ROS 2."""

    def __init__(
        self, link: Ros2Link, settings: Ros2ArmSettings, *, now_ns: Callable[[], int], sleep: Callable[[float], None]
    ) -> None:
        super().__init__()
        self.settings = settings
        self._link, self._now_ns, self._sleep = link, now_ns, sleep
        self._stamps = StampClock(link.reads)
        self._seen_rad: tuple[float, ...] = ()
        self._heard_ns = self._time_ns = 0

    def open(self) -> None:
        """Find the robot without sending anything."""
        self._require("open()", ArmState.NEW)
        self._link.open()
        await_publisher(self._link, self.settings.start_s, self._sleep)
        self._await_news()
        self._state = ArmState.CONFIGURED

    def enable(self) -> None:
        """Start sending commands to the controller; the arm holds its position."""
        self._require("enable()", ArmState.CONFIGURED)
        require_one_publisher(self._link)
        self._await_news()
        settings = self.settings
        limits = zip(settings.joints, self._seen_rad, settings.lower_rad, settings.upper_rad, strict=True)
        for joint, angle, low, high in limits:
            if not low <= angle <= high:
                problem = f"{joint} stands at {angle:.4f} rad, outside {low:.4f} to {high:.4f}"
                raise SettingError(NAME, problem, "move it back by the robot's own means")
        require_subscriber(self._link)
        self.setpoint_rad = self._seen_rad
        self._state = ArmState.ENABLED

    def cycle(self, setpoint_rad: Sequence[float] | None = None, /) -> Measured:
        """Read the latest angles and send a command, at most one period ahead of them; None holds the position."""
        self._require("cycle()", ArmState.CONFIGURED, ArmState.ENABLED, ArmState.STOPPED)
        enabled, settings, goal_rad = self._state is ArmState.ENABLED, self.settings, self.setpoint_rad
        with self._latching():
            self._take()
            require_one_publisher(self._link)
            if enabled:
                require_subscriber(self._link)
            if self._state is not ArmState.STOPPED:
                self._require_heard()
        if setpoint_rad is not None:
            self._require("a set-point", ArmState.ENABLED, ArmState.STOPPED)
            requested = require_angles(setpoint_rad, len(settings.joints))
            most_rad = [speed * settings.period_s for speed in settings.velocity_rad_s]
            goal_rad = held_back(clamped(requested, settings.lower_rad, settings.upper_rad), self._seen_rad, most_rad)
        with self._latching():
            if enabled:
                self._command(goal_rad)
            elif self._state is ArmState.STOPPED:
                self._hold()
        return Measured(self._seen_rad, self._time_ns)

    @override
    def diagnostics(self) -> dict[str, str]:
        return super().diagnostics() | link_diagnostics(self._link, self._stamps)

    def stop(self) -> None:
        """Hold the arm, or send zero velocities. May be called at any time and repeatedly; never raises."""
        if self._state is ArmState.ENABLED:
            self._state = ArmState.STOPPED
        elif self._state not in (ArmState.STOPPED, ArmState.FAULTED):
            return
        with suppress(DriverError):
            self._hold()

    def run_out(self) -> float | None:
        """Move the last joint slowly, stop sending commands, and wait for the robot to stop by itself.

        Returns:
            Time until the joint was stationary, s; None if it had to be stopped.

        Raises:
            DriverError: The joint does not follow, or the robot stops sending data.
        """
        self._require("run_out()", ArmState.ENABLED)
        if not self.settings.velocities:
            raise SettingError(NAME, "stops_without_commands is of no use to positions", "remove it from the rig file")
        settings, start_rad, seen = self.settings, self._seen_rad[-1], list[tuple[float, float]]()
        middle_rad = 0.5 * (settings.lower_rad[-1] + settings.upper_rad[-1])
        speed = _RUN_RAD_S if start_rad < middle_rad else -_RUN_RAD_S
        try:
            for _ in range(round(_RUN_S / settings.period_s)):
                self._link.write((0.0,) * (len(settings.joints) - 1) + (speed,))
                self._sleep(settings.period_s)
                self._take()
            if (self._seen_rad[-1] - start_rad) / speed < 0.5 * _RUN_S:
                remedy = "see that the controller takes velocities"
                raise SettingError(NAME, f"{settings.joints[-1]} does not follow a velocity", remedy)
            begin_ns, time_s = self._now_ns(), 0.0
            while time_s < _WAIT_S:
                self._sleep(_LOOK_S)
                self._take()
                self._require_heard()
                time_s = (self._now_ns() - begin_ns) * 1e-9
                seen.append((time_s, self._seen_rad[-1]))
        finally:
            self.stop()
        moving_s = [time_s for time_s, angle in seen if abs(angle - seen[-1][1]) > _STILL_RAD]
        stood_s = max(moving_s, default=0.0)
        return stood_s if stood_s < 0.75 * _WAIT_S else None

    def acknowledge(self) -> None:
        """Clear a fault; it stays if its cause persists. Only a person may decide to do this."""
        self._require_fault()
        # The clock of a restarted robot is different.
        self._stamps = StampClock(self._link.reads)
        require_one_publisher(self._link)
        self._await_news()
        self._state, self.fault = ArmState.CONFIGURED, None

    def close(self) -> None:
        """Stop, and leave the domain; never raises."""
        self.stop()
        self._link.close()
        self._state = ArmState.CLOSED

    def _take(self) -> None:
        messages, now_ns = self._link.take(), self._now_ns()
        if not messages:
            return
        times_ns = self._stamps.times_ns(messages, now_ns)
        # Each message is checked, and the latest is used.
        angles = [joint_angles(message, self.settings.joints, self._link.reads) for message in messages]
        self._seen_rad, self._time_ns, self._heard_ns = angles[-1], times_ns[-1], now_ns

    def _await_news(self) -> None:
        """Wait for a new message, because those already received may be old or precede a fault."""
        self._link.take()
        begin_ns, before_ns = self._now_ns(), self._time_ns
        while self._time_ns == before_ns:
            if (self._now_ns() - begin_ns) * 1e-9 > self.settings.start_s:
                raise SilentError(NAME, f"no new message of {self._link.reads} has come", "see whether it is published")
            self._sleep(_LOOK_S)
            self._take()

    def _require_heard(self) -> None:
        silent_s = (self._now_ns() - self._heard_ns) * 1e-9
        if silent_s > self.settings.silence_s:
            problem = f"no message of {self._link.reads} for {silent_s * 1e3:.0f} ms"
            raise SilentError(NAME, problem, "check the robot's driver and the network, and how busy this computer is")

    def _command(self, goal_rad: tuple[float, ...]) -> None:
        settings, before = self.settings, self.setpoint_rad
        self.setpoint_rad = goal_rad
        if not settings.velocities:
            self._link.write(goal_rad)
            return
        joints = zip(goal_rad, before, self._seen_rad, settings.velocity_rad_s, strict=True)
        wanted = [((a - b) / settings.period_s + _GAIN_PER_S * (a - q), most) for a, b, q, most in joints]
        self._link.write([min(max(speed, -most), most) for speed, most in wanted])

    def _hold(self) -> None:
        if self.setpoint_rad:
            self._link.write(held(self.setpoint_rad, self.settings.velocities))


def held(position_rad: Sequence[float], velocities: bool) -> tuple[float, ...]:
    """Return the command that makes an arm hold a position."""
    return (0.0,) * len(position_rad) if velocities else tuple(position_rad)


def link_diagnostics(link: Ros2Link, stamps: StampClock) -> dict[str, str]:
    """Return the publishers and subscribers with their quality of service, and the state of the publisher's clock."""
    found = {}
    if stamps.stamp_ns:
        behind_ms = (link.wall_ns() - stamps.stamp_ns) * 1e-6
        found["stamps"] = f"the newest is {behind_ms:.1f} ms behind this computer's time of day"
    sends = "; ".join(", ".join(each) for each in link.endpoints(link.reads)) or "none"
    found[f"publishers of {link.reads}"] = f"{sends} (requested: best effort, volatile)"
    if link.writes:
        takes = "; ".join(", ".join(each) for each in link.endpoints(link.writes)) or "none"
        found[f"subscribers of {link.writes}"] = f"{takes} (offered: reliable, volatile)"
    return found
