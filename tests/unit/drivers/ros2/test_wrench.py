"""A force sensor behind ROS 2 in virtual time: what ends its use."""

from itertools import pairwise
from math import nan

import pytest

from palpate.drivers.errors import DriverError
from palpate.drivers.ros2 import WRENCH, Ros2Wrench
from tests.virtual_ros2 import VirtualDomain


def opened(domain, frame="tool0"):
    link = domain.link("wrench", WRENCH, "")
    link.open()
    sensor = Ros2Wrench(link, frame)
    domain.ticks(2)
    return sensor


def with_force(value):
    def network(message):
        if hasattr(message, "wrench"):
            message.wrench.force.x = value
        return message

    return network


def framed(message):
    message.header.frame_id = "ft_frame"
    return message


TROUBLES = {
    "unknown frame": (
        lambda domain: setattr(domain, "network", framed),
        "/wrench is in frame 'ft_frame', the rig file says 'tool0'; set .force_sensor. frame if",
    ),
    "NaN": (lambda domain: setattr(domain, "network", with_force(nan)), "a wrench of /wrench is no number"),
    "two publishers": (lambda domain: setattr(domain, "publishers", 2), "2 publishers send /wrench"),
    "clock set back": (
        lambda domain: setattr(domain, "stamp_ns", domain.stamp_ns - 10**9), "stamps of /wrench jump back by 0.9",
    ),
    "silence": (lambda domain: setattr(domain, "is_plugged", False), "nothing new for 1"),
}  # fmt: skip


@pytest.mark.parametrize("trouble", TROUBLES)
def test_trouble_is_raised_in_one_line(trouble):
    domain = VirtualDomain()
    sensor = opened(domain)
    assert sensor.poll(domain.clock.now_ns())[-1].force_N == (0.0, 0.0, -5.0)
    sensor.check()
    TROUBLES[trouble][0](domain)
    domain.ticks(20)
    sensor.poll(domain.clock.now_ns())
    with pytest.raises(DriverError, match=TROUBLES[trouble][1]):
        sensor.check()


def test_samples_carry_the_times_of_their_stamps():
    domain = VirtualDomain()
    sensor = opened(domain)
    sensor.poll(domain.clock.now_ns())
    domain.ticks(1)
    times_ns = [sample.receive_time_ns for sample in sensor.poll(domain.clock.now_ns())]
    assert [b - a for a, b in pairwise(times_ns)] == pytest.approx([2e6] * (len(times_ns) - 1))
    assert domain.clock.now_ns() - times_ns[-1] < 2.1e6
