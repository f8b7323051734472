"""A peer on the real rclpy, in an environment of its own: a robot that is driven, or a client that drives one.

    python rclpy_peer.py robot     publishes joints and wrenches, takes commands
    python rclpy_peer.py client    reads joints and wrenches, sends commands

It ends when its standard input does, and then prints as JSON what it has seen.
"""

import json
import math
import sys
import threading
import time

import rclpy
from geometry_msgs.msg import WrenchStamped
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

JOINTS, WRENCHES, COMMANDS = (
    "joint_states",
    "force_torque_sensor_broadcaster/wrench",
    "forward_position_controller/commands",
)
NAMES = ["pan", "lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
HOME = [0.1, -1.2, 1.3, -1.6, -1.5, 0.2]
STEP_RAD, PERIOD_S = 0.001, 0.004
SENSOR = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


class Robot:
    """Joints that stand at their set-points at once."""

    commands = QoSProfile(depth=10)

    def __init__(self, node):
        self.position, self.seen = HOME, {"commands": 0, "last": HOME, "longest_gap_s": 0.0}
        self.came_s = math.nan
        self.joints = node.create_publisher(JointState, JOINTS, 10)
        self.wrenches = node.create_publisher(WrenchStamped, WRENCHES, 10)
        node.create_subscription(Float64MultiArray, COMMANDS, self.take, self.commands)
        node.create_timer(PERIOD_S, lambda: self.publish(node.get_clock().now().to_msg()))

    def take(self, message):
        gap_s, self.came_s = time.monotonic() - self.came_s, time.monotonic()
        self.seen["longest_gap_s"] = max(self.seen["longest_gap_s"], gap_s if gap_s == gap_s else 0.0)
        self.seen["commands"] += 1
        self.position = self.seen["last"] = list(message.data)

    def publish(self, stamp):
        joints, wrench = JointState(), WrenchStamped()
        joints.header.stamp = wrench.header.stamp = stamp
        joints.name, joints.position = [*NAMES, "gripper"], [*self.position, math.nan]
        wrench.header.frame_id = "tool0"
        wrench.wrench.force.z, wrench.wrench.torque.x = -5.0, -0.0
        self.joints.publish(joints)
        self.wrenches.publish(wrench)


class Client:
    """Turns the last joint, a step a period."""

    def __init__(self, node):
        self.seen = {"joints": 0, "wrenches": 0, "frame": "", "names": [], "position": [], "force": []}
        self.goal = []
        self.commands = node.create_publisher(Float64MultiArray, COMMANDS, 10)
        node.create_subscription(JointState, JOINTS, self.joints, SENSOR)
        node.create_subscription(WrenchStamped, WRENCHES, self.wrench, SENSOR)
        node.create_timer(PERIOD_S, self.send)

    def joints(self, message):
        self.seen["joints"] += 1
        self.seen["names"], self.seen["position"] = list(message.name), list(message.position)
        self.goal = self.goal or list(message.position)

    def wrench(self, message):
        self.seen["wrenches"] += 1
        force = message.wrench.force
        self.seen["frame"], self.seen["force"] = message.header.frame_id, [force.x, force.y, force.z]

    def send(self):
        if self.goal:
            self.goal[-1] += STEP_RAD
            self.commands.publish(Float64MultiArray(data=self.goal))


def main():
    rclpy.init()
    node = rclpy.create_node("peer")
    peer = {"robot": Robot, "client": Client}[sys.argv[1]](node)
    threading.Thread(target=lambda: (sys.stdin.read(), rclpy.try_shutdown()), daemon=True).start()
    try:
        rclpy.spin(node)
    except Exception as error:
        if rclpy.ok():
            raise error
    json.dump(peer.seen, sys.stdout)


if __name__ == "__main__":
    main()
