from .arm import Ros2Arm as Ros2Arm
from .judgement import await_publisher as await_publisher
from .link import Ros2Link as Ros2Link
from .settings import JOINT_STATE as JOINT_STATE
from .settings import WRENCH as WRENCH
from .settings import Ros2ArmSettings as Ros2ArmSettings
from .settings import Ros2Network as Ros2Network
from .wrench import Ros2Wrench as Ros2Wrench
