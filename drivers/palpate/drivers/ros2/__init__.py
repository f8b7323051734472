"""Driver for an arm and a force sensor that use ROS 2. ROS need not be installed: the cyclonedds library provides DDS.

Joint angles arrive as ``sensor_msgs/JointState``, wrenches as ``geometry_msgs/WrenchStamped``; commands are sent as
``std_msgs/Float64MultiArray`` to a ``forward_command_controller``, which holds its last command without a time limit.
Not tested on a real arm.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
