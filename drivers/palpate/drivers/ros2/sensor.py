"""A polled force sensor that uses ROS 2."""

from collections.abc import Sequence
from contextlib import suppress
from math import isfinite
from typing import Any, Final

from typing_extensions import override

from palpate.drivers.device import ForceSample, PolledSensor
from palpate.drivers.errors import DriverError, GarbledError, WiringError
from palpate.drivers.ros2.device import link_diagnostics
from palpate.drivers.ros2.judgement import StampClock, require_one_publisher
from palpate.drivers.ros2.link import Ros2Link

_NAME: Final = "ROS 2 wrench"


class Ros2Wrench(PolledSensor):
    """The force sensor on an open link. Sample times are taken from the message timestamps.

    Args:
        frame: Required ``frame_id`` in the messages.
        sign: 1 if the messages contain the wrench that the world exerts on the tool, -1 if they contain the opposite.
    """

    def __init__(self, link: Ros2Link, frame: str, sign: int = 1) -> None:
        super().__init__(_NAME, f"check the robot's driver, its topic {link.reads} and the network")
        self._link, self._frame, self._sign = link, frame, sign
        self._stamps = StampClock(link.reads)
        self._count = 0

    @override
    def poll(self, now_ns: int) -> list[ForceSample]:
        self._polled_ns = now_ns
        try:
            require_one_publisher(self._link)
            messages = self._link.take()
            samples = self._samples(messages, now_ns) if messages else []
        except DriverError as error:
            self.failure = self.failure or error
            return []
        self.latest = samples[-1] if samples else self.latest
        return samples

    def _samples(self, messages: Sequence[Any], now_ns: int) -> list[ForceSample]:
        samples = []
        times_ns = self._stamps.times_ns(messages, now_ns)
        for message, time_ns in zip(messages, times_ns, strict=True):
            if (frame := message.header.frame_id) != self._frame:
                problem = f"{self._link.reads} is in frame {frame!r}, the rig file says {self._frame!r}"
                raise WiringError(_NAME, problem, "set [force_sensor] frame if sign, axes and point are right")
            force, torque = message.wrench.force, message.wrench.torque
            parts = tuple(self._sign * part for part in (force.x, force.y, force.z, torque.x, torque.y, torque.z))
            if not all(map(isfinite, parts)):
                problem = f"a wrench of {self._link.reads} is no number: {parts}"
                raise GarbledError(_NAME, problem, "see whether the robot's driver has its sensor")
            self._count += 1
            samples.append(ForceSample(parts[:3], parts[3:], self._count, time_ns))
        return samples

    @override
    def diagnostics(self) -> dict[str, str]:
        return super().diagnostics() | link_diagnostics(self._link, self._stamps)

    @override
    def acknowledge(self) -> None:
        super().acknowledge()
        with suppress(DriverError):
            # Messages received so far may belong to the acknowledged fault.
            self._link.take()
        self._stamps = StampClock(self._link.reads)
