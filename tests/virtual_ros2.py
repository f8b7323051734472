"""An emulated robot behind ROS 2 in virtual time, and links to it without a participant or a socket."""

from copy import deepcopy
from typing import Any

import pytest

from palpate.drivers.errors import SilentError
from palpate.drivers.ros2 import JOINT_STATE, WRENCH, Ros2Link, Ros2Network
from palpate.simulation.emulators.ros2 import FRAME, JOINT_STATES, Ros2Robot
from tests.virtual_time import VirtualTime

HOME = (0.1, -1.2, 1.3, -1.6, -1.5, 0.2)
NAMES = ("pan", "lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
COMMANDS = "/controller/commands"
PERIOD_NS = 2_000_000
_BOOT_NS = 1_700_000_000 * 10**9


class VirtualDomain:
    """The robot, joints that stand at their set-points, and the network between it and its links."""

    def __init__(self, clock=None, robot=None, **settings):
        self.idl = pytest.importorskip("palpate.simulation.emulators.ros2.idl", reason="needs the extra ros2")
        self.clock, self.moves = clock or VirtualTime(), robot is None
        self.robot = robot or Ros2Robot(NAMES, HOME, **settings)
        self.load = [0.0, 0.0, -5.0, 0.0, 0.0, 0.0]
        self.network = lambda message: message
        self.is_plugged, self.publishers, self.stamp_ns = True, 1, _BOOT_NS
        self.seen = [], []
        self.links = []
        self._due_ns = 0
        self.wrench = lambda now_ns: self.load
        self.clock.devices.append(self)

    def link(self, reads=JOINT_STATES, kind=JOINT_STATE, writes=COMMANDS):
        made = VirtualLink(self, f"/{reads}", kind, writes)
        self.links.append(made)
        return made

    @property
    def is_open(self):
        return any(link.is_open for link in self.links)

    def ticks(self, count):
        self.clock.sleep(count / 140)

    def next_event_ns(self):
        return self._due_ns

    def step(self, now_ns):
        self._due_ns = now_ns + PERIOD_NS
        self.robot.step(now_ns)
        if self.moves:
            self.robot.measured_rad(self.robot.targets_rad())
        stamp_ns = self.stamp_ns + now_ns
        joints = self.idl.joint_state(stamp_ns, self.robot.names, self.robot.position_rad)
        for kind, message in ((JOINT_STATE, joints), (WRENCH, self.idl.wrench(stamp_ns, FRAME, self.wrench(now_ns)))):
            sent = self.network(message)
            for link in self.links:
                if sent is not None and self.is_plugged and link.is_open and link.kind == kind:
                    link.waiting = [*link.waiting[-63:], deepcopy(sent)]


class VirtualLink(Ros2Link):
    """What an open link has of the robot."""

    def __init__(self, domain, reads, kind, writes):
        super().__init__(Ros2Network(0), (reads, kind), writes)
        self.domain, self.is_open, self.waiting = domain, False, list[Any]()

    def open(self):
        self.is_open, self.waiting = True, []

    def close(self):
        self.is_open = False

    def take(self):
        self._require()
        taken, self.waiting = self.waiting, []
        return taken

    def write(self, values):
        self._require()
        if self.domain.is_plugged:
            self.domain.robot.command(list(values), self.domain.clock.now_ns())

    def publishers(self):
        return self.domain.publishers

    def subscribers(self):
        return int(self.domain.robot.is_active)

    def endpoints(self, topic):
        return self.domain.seen[topic == self.writes]

    def wall_ns(self):
        return self.domain.stamp_ns + self.domain.clock.now_ns()

    def _require(self):
        if not self.is_open:
            raise SilentError("link", "the link is closed", "open it")
