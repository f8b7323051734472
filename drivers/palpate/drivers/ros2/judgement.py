"""Checks on messages, publishers and subscribers."""

from collections.abc import Callable, Sequence
from math import isfinite
from typing import Any, Final

from palpate.drivers.errors import DriverError, GarbledError, WiringError
from palpate.drivers.ros2.link import Ros2Link
from palpate.drivers.ros2.settings import COMMANDS, NAME

_NS: Final = 1_000_000_000
_LEAP_NS: Final = _NS // 4
"""Maximum lead of a timestamp over its message's arrival; a larger lead means that the clock was set forward."""
_DRIFT: Final = 1e-4
"""Maximum relative drift between two clocks."""
_LOOK_S: Final = 0.01
_SYNC: Final = "synchronise clocks (chrony), and let one clock stamp the messages"


class StampClock:
    """Converter from a publisher's timestamps to this computer's clock, as if its fastest message had no delay."""

    def __init__(self, topic: str) -> None:
        self._topic, self.stamp_ns = topic, 0
        self._delay_ns: int | None = None
        self._heard_ns = self._time_ns = 0

    def times_ns(self, messages: Sequence[Any], receive_ns: int) -> list[int]:
        """Return the measurement times of messages received together, in increasing order.

        Raises:
            GarbledError: The publisher's clock was changed, or the messages contain no time.
        """
        stamps_ns = [message.header.stamp.sec * _NS + message.header.stamp.nanosec for message in messages]
        for stamp_ns in stamps_ns:
            if stamp_ns <= 0:
                raise GarbledError(NAME, f"messages of {self._topic} carry no time", "let the publisher stamp them")
            if stamp_ns < self.stamp_ns:
                raise self._jump("back", self.stamp_ns - stamp_ns)
        before_ns = self.stamp_ns
        self.stamp_ns = stamps_ns[-1]
        delay_ns = receive_ns - self.stamp_ns
        if self._delay_ns is None:
            self._delay_ns = delay_ns
        elif (ahead_ns := self._delay_ns - delay_ns) > _LEAP_NS:
            raise self._jump("ahead", ahead_ns)
        self._delay_ns = min(self._delay_ns + round(_DRIFT * (receive_ns - self._heard_ns)), delay_ns)
        self._heard_ns = receive_ns
        times_ns = []
        for stamp_ns in stamps_ns:
            if stamp_ns > before_ns:
                self._time_ns = max(self._time_ns + 1, stamp_ns + self._delay_ns)
            before_ns = stamp_ns
            times_ns.append(self._time_ns)
        return times_ns

    def _jump(self, where: str, by_ns: int) -> GarbledError:
        return GarbledError(NAME, f"stamps of {self._topic} jump {where} by {by_ns * 1e-9:.3f} s", _SYNC)


def joint_angles(message: Any, joints: Sequence[str], topic: str) -> tuple[float, ...]:
    """Return the angles of these joints, found by name in the message, (n,) rad.

    Raises:
        DriverError: An angle is missing or not a number.
    """
    names, angles = list(message.name), list(message.position)
    if len(names) != len(angles):
        problem = f"a message of {topic} has {len(names)} names and {len(angles)} positions"
        raise GarbledError(NAME, problem, "see who sends it")
    found = dict(zip(names, angles, strict=True))
    missing = [joint for joint in joints if joint not in found]
    if missing:
        problem = f"{topic} has no joint {', '.join(missing)}; it has {', '.join(names) or 'none'}"
        raise WiringError(NAME, problem, "set [arm] joints to their names there, base first")
    for joint in joints:
        if not isfinite(found[joint]):
            problem = f"joint {joint} of {topic} is {found[joint]}"
            raise GarbledError(NAME, problem, "see whether the robot's driver has its encoders")
    return tuple(float(found[joint]) for joint in joints)


def await_publisher(link: Ros2Link, timeout_s: float, sleep: Callable[[float], None]) -> None:
    """Wait for the publisher; raises WiringError unless exactly one matches."""
    waited_s = 0.0
    while not link.publishers():
        if waited_s >= timeout_s:
            raise no_publisher(link)
        sleep(_LOOK_S)
        waited_s += _LOOK_S
    require_one_publisher(link)


def require_one_publisher(link: Ros2Link) -> None:
    """Raise an error if a topic has several publishers."""
    if (found := link.publishers()) > 1:
        problem = f"{found} publishers send {link.reads}"
        raise WiringError(NAME, problem, "end all but one; one that has died counts for up to 20 s")


def no_publisher(link: Ros2Link) -> DriverError:
    """Return the error for a topic without a compatible publisher."""
    others = [kind for kind, _ in link.endpoints(link.reads) if kind != link.kind]
    if others:
        problem = f"{link.reads} carries {others[0]}, not {link.kind}"
        return WiringError(NAME, problem, "name another topic in the rig file")
    network = link.network
    problem = f"no publisher of {link.reads} in domain {network.domain}"
    remedy = "start the robot's driver, and check topic, domain, address and peers in the rig file"
    return WiringError(NAME, problem, remedy)


def require_subscriber(link: Ros2Link) -> None:
    """Raise an error if there is no controller for the commands, or only one with incompatible requirements."""
    if link.subscribers():
        return
    unfit = [f"{kind}, {qos}" for kind, qos in link.endpoints(link.writes)]
    if unfit:
        problem = f"the subscriber of {link.writes} wants {unfit[0]}; offered is {COMMANDS}, reliable, volatile"
        raise WiringError(NAME, problem, "name another topic in the rig file, or change the controller")
    remedy = "activate the forward_command_controller: ros2 control switch_controllers --activate NAME"
    raise WiringError(NAME, f"no subscriber to {link.writes}: the controller is not active", remedy)
