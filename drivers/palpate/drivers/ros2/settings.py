"""What a rig file says of a robot behind ROS 2, and the names of its messages."""

from dataclasses import dataclass
from typing import Final

NAME: Final = "ROS 2 arm"
JOINT_STATE: Final = "sensor_msgs/msg/JointState"
WRENCH: Final = "geometry_msgs/msg/WrenchStamped"
COMMANDS: Final = "std_msgs/msg/Float64MultiArray"


@dataclass(frozen=True, slots=True)
class Ros2Network:
    """Where the robot is.

    Attributes:
        domain: The robot's ROS_DOMAIN_ID.
        address: This computer's address on the robot's network; empty: the system chooses.
        peers: Addresses of computers to look for; empty: multicast finds them.
    """

    domain: int
    address: str = ""
    peers: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Ros2ArmSettings:
    """What the rig file says of the arm. Vectors have one number a joint, base first, (n,).

    Attributes:
        joints: Names of the joints in the messages.
        lower_rad: Lower joint limits. upper_rad: Upper ones. velocity_rad_s: Velocity limits.
        period_s: Time between two commands.
        velocities: Command velocities, instead of positions.
        start_s: Longest wait for publisher and first message.
        silence_s: So long without joint angles is a fault.
    """

    joints: tuple[str, ...]
    lower_rad: tuple[float, ...]
    upper_rad: tuple[float, ...]
    velocity_rad_s: tuple[float, ...]
    period_s: float
    velocities: bool = False
    start_s: float = 5.0
    silence_s: float = 0.1
