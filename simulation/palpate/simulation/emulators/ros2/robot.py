"""Emulated robot whose joints are controlled by a ros2_control forward_command_controller."""

from collections.abc import Sequence
from typing import Final

from palpate.core.ports import JointVector

FRAME: Final = "tool0"
JOINT_STATES: Final = "joint_states"
WRENCH: Final = "force_torque_sensor_broadcaster/wrench"


class Ros2Robot:
    """A robot whose joints are moved by the simulation. It uses neither sockets nor a clock.

    According to the ros2_controllers source, wrong-sized commands are dropped, and the last command is held
    without a time limit.

    Args:
        stop_ms: Time without a velocity command after which the robot's driver stops the arm; 0 disables this.
    """

    def __init__(
        self, names: Sequence[str], start_rad: JointVector, *, velocities: bool = False, stop_ms: float = 0.0
    ) -> None:
        self.names, self.is_active = tuple(names), True
        self.position_rad: JointVector = tuple(start_rad)
        self.command_ns = 0
        self._stop_ns = round(stop_ms * 1e6)
        self._velocities, self._targets = velocities, tuple(start_rad)
        self._speeds = (0.0,) * len(self.names)
        self._stepped_ns: int | None = None

    def command(self, data: Sequence[float], now_ns: int) -> None:
        """Accept a command."""
        if len(data) != len(self.names) or not self.is_active:
            return
        self.command_ns = now_ns
        if self._velocities:
            self._speeds = tuple(data)
        else:
            self._targets = tuple(data)

    def step(self, now_ns: int) -> None:
        """Advance the time."""
        elapsed_s = 0.0 if self._stepped_ns is None else (now_ns - self._stepped_ns) * 1e-9
        self._stepped_ns = now_ns
        if self._stop_ns and now_ns - self.command_ns > self._stop_ns:
            self._speeds = (0.0,) * len(self.names)
        steps = zip(self._targets, self._speeds, strict=True)
        self._targets = tuple(angle + speed * elapsed_s for angle, speed in steps)

    def targets_rad(self) -> JointVector:
        """Return the joint set-points that the servos hold, (n,) rad."""
        return self._targets

    def measured_rad(self, joints_rad: JointVector) -> None:
        """Set the joint angles, (n,) rad."""
        self.position_rad = tuple(joints_rad)
