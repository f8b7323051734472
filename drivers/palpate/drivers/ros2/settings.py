"""Settings for a ROS 2 robot in a rig file."""

from dataclasses import dataclass
from typing import Final

NAME: Final = "ROS 2 arm"
JOINT_STATE: Final = "sensor_msgs/msg/JointState"
WRENCH: Final = "geometry_msgs/msg/WrenchStamped"
COMMANDS: Final = "std_msgs/msg/Float64MultiArray"


@dataclass(frozen=True)
class Ros2Network:
    """Network settings for the robot.

    Attributes:
        domain: The robot's ROS_DOMAIN_ID.
        address: This computer's address on the robot's network; if empty, the system chooses.
        peers: Addresses of computers to contact; if empty, multicast finds them.
    """

    domain: int
    address: str = ""
    peers: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Ros2ArmSettings:
    """Arm settings in the rig file. Vectors have one number per joint, base first, (n,).

    Attributes:
        period_s: Time between commands.
        velocities: True to command velocities instead of positions.
        start_s: Maximum wait for the publisher and the first message.
        silence_s: Time without joint angles that counts as a fault.
    """

    joints: tuple[str, ...]
    lower_rad: tuple[float, ...]
    upper_rad: tuple[float, ...]
    velocity_rad_s: tuple[float, ...]
    period_s: float
    velocities: bool = False
    start_s: float = 5.0
    silence_s: float = 0.1
