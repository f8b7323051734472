from .robot import FRAME as FRAME
from .robot import JOINT_STATES as JOINT_STATES
from .robot import WRENCH as WRENCH
from .robot import Ros2Robot as Ros2Robot
from .server import Ros2Server as Ros2Server
