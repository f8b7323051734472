"""Driver for an arm and a force sensor behind ROS 2, without a ROS installation: DDS by the library cyclonedds.

Joint angles come as ``sensor_msgs/JointState``, wrenches as ``geometry_msgs/WrenchStamped``, commands go as
``std_msgs/Float64MultiArray`` to a ``forward_command_controller``. That controller keeps its last command for ever.
Nothing here has met a real arm.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
