"""The robot: joints under a forward_command_controller of ros2_control."""

from collections.abc import Sequence
from typing import Final

from palpate.core.ports import JointVector

FRAME: Final = "tool0"
JOINT_STATES: Final = "joint_states"
WRENCH: Final = "force_torque_sensor_broadcaster/wrench"


class Ros2Robot:
    """Joints that somebody else moves; uses neither sockets nor a clock.

    As read in ros2_controllers: commands of another size are dropped, and the last one is kept for ever.

    Args:
        names: Names of the joints, base first, as controller and messages have them.

    Attributes:
        is_active: Whether there is a controller that takes commands.
        command_ns: When the last command came.
    """

    def __init__(self, names: Sequence[str], start_rad: JointVector) -> None:
        self.names, self.is_active = tuple(names), True
        self.position_rad: JointVector = tuple(start_rad)
        self.command_ns = 0
        self._targets_rad = tuple(start_rad)

    def command(self, data: Sequence[float], now_ns: int) -> None:
        """Take a command."""
        if len(data) == len(self.names) and self.is_active:
            self.command_ns, self._targets_rad = now_ns, tuple(data)

    def targets_rad(self) -> JointVector:
        """Joint set-points that the servos hold now, (n,) rad."""
        return self._targets_rad

    def measured_rad(self, joints_rad: JointVector) -> None:
        """Feed back where the joints are, (n,) rad."""
        self.position_rad = tuple(joints_rad)
