"""Server for an emulated robot on this computer's loopback interface, using ROS 2's DDS."""

import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final, Self

from palpate.simulation.emulators.ros2.robot import FRAME, JOINT_STATES, WRENCH, Ros2Robot

_NS: Final = 1_000_000_000
_DOMAINS: Final = range(60, 100)
"""Domains whose ports are below those that the system assigns."""
_CONFIGURATION: Final = """<CycloneDDS><Domain><General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex><Peers>
<Peer address="127.0.0.1"/></Peers></Discovery><Compatibility><IgnoreTypeInformation>1.15</IgnoreTypeInformation>
</Compatibility></Domain></CycloneDDS>"""


class Ros2Server:
    """Context manager with a thread that serves and steps a robot.

    Attributes:
        domain: A free ROS_DOMAIN_ID.
        commands: The controller's command topic.
        network: Filter for messages; set it to change messages, or to drop them by returning None.
    """

    address: Final = "127.0.0.1"
    commands: Final = "forward_position_controller/commands"

    def __init__(
        self,
        robot: Ros2Robot,
        wrench: Callable[[int], tuple[float, ...]],
        rate_Hz: float = 500.0,
        clock_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._clock_ns = clock_ns
        self.domain, self.rate_Hz, self.is_unplugged = 0, rate_Hz, False
        self.network: Callable[[Any], Any] = lambda message: message
        self._robot, self._wrench, self._lock = robot, wrench, threading.Lock()
        self._ended = threading.Event()

    def __enter__(self) -> Self:
        from cyclonedds.domain import Domain, DomainParticipant

        self.domain = next(each for each in _DOMAINS if _is_free(each))
        # The domain lives in this process as long as this object.
        self._opened = Domain(self.domain, _CONFIGURATION)
        self._participant = DomainParticipant(self.domain)
        self._ended.clear()
        self._thread = threading.Thread(target=self._serve, name="ROS 2 emulator", daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        del self._participant, self._opened

    @contextmanager
    def exclusive(self) -> Iterator[Ros2Robot]:
        """Yield the robot. The server's thread does not access it in this context."""
        with self._lock:
            yield self._robot

    def _serve(self) -> None:
        from cyclonedds.core import Policy, Qos
        from cyclonedds.pub import DataWriter
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic

        from palpate.simulation.emulators.ros2 import idl

        def topic(name: str, kind: Any) -> Any:
            return Topic(self._participant, f"rt/{name}", kind)

        offered = Qos(Policy.Reliability.Reliable(0), Policy.History.KeepLast(10))
        joints = DataWriter(self._participant, topic(JOINT_STATES, idl.JointState), offered)
        wrenches = DataWriter(self._participant, topic(WRENCH, idl.WrenchStamped), offered)
        wanted = Qos(Policy.Reliability.Reliable(0), Policy.History.KeepLast(10))
        controller: Any = None
        due_ns = self._clock_ns()
        epoch_ns = time.time_ns() - due_ns
        while not self._ended.is_set():
            now_ns = self._clock_ns()
            if self._robot.is_active != (controller is not None):
                commands = topic(self.commands, idl.Float64MultiArray)
                controller = DataReader(self._participant, commands, wanted) if self._robot.is_active else None
            with self._lock:
                for message in [] if controller is None else controller.take(16):
                    if message.sample_info.valid_data and not self.is_unplugged:
                        self._robot.command(message.data, now_ns)
                self._robot.step(now_ns)
                angles = self._robot.position_rad
            stamp_ns = epoch_ns + now_ns
            for writer, message in (
                (joints, idl.joint_state(stamp_ns, self._robot.names, angles)),
                (wrenches, idl.wrench(stamp_ns, FRAME, self._wrench(now_ns))),
            ):
                sent = None if self.is_unplugged else self.network(message)
                if sent is not None:
                    writer.write(sent)
            due_ns = max(due_ns + round(_NS / self.rate_Hz), now_ns)
            time.sleep(max(0, due_ns - self._clock_ns()) * 1e-9)


def _is_free(domain: int) -> bool:
    """Return True if no participant uses the domain's first port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("", 7410 + 250 * domain))
        except OSError:
            return False
    return True
