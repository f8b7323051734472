"""Two links in one process, over the loopback of this computer: what one writes, the other reads."""

import os

import pytest

from palpate.drivers.errors import GarbledError, SettingError, SilentError
from palpate.drivers.ros2 import JOINT_STATE, Ros2Link, Ros2Network
from palpate.drivers.ros2 import link as module
from palpate.drivers.ros2.settings import COMMANDS
from tests.wall_clock.late import wait_for

pytest.importorskip("cyclonedds", reason="needs the extra ros2")
LOOPBACK = Ros2Network(100 + os.getpid() % 100, "127.0.0.1", ("127.0.0.1",))


@pytest.fixture
def links():
    made = Ros2Link(LOOPBACK, ("/joint_states", JOINT_STATE), "/commands"), Ros2Link(LOOPBACK, ("/commands", COMMANDS))
    for one in made:
        one.open()
    yield made
    for one in made:
        one.close()


def test_command_arrives_and_both_sides_know_each_other(links):
    arm, robot = links
    assert robot.take() == []
    assert arm.publishers() == 0
    wait_for(lambda: arm.subscribers() and robot.publishers())
    arm.write((0.1, -0.2))
    (taken,) = wait_for(robot.take)
    assert list(taken.data) == [0.1, -0.2]
    assert arm.endpoints("/commands") == [(COMMANDS, "Volatile, BestEffort")]
    assert robot.endpoints("/commands") == [(COMMANDS, "Volatile, Reliable")]
    assert arm.endpoints("/joint_states") == []
    arm.close()
    wait_for(lambda: not robot.publishers())
    assert robot.take() == []


def test_closed_link_and_values_that_do_not_fit_are_refused(links):
    arm, robot = links
    with pytest.raises(SilentError, match="a command cannot be sent"):
        arm.write(("x",))
    arm.close()
    for call in (arm.take, arm.publishers, arm.subscribers, lambda: arm.write((0.1,))):
        with pytest.raises(SilentError, match="the link is closed"):
            call()

    class Invalid:
        def take(self, most):
            raise ValueError("bytes")

    robot._reader = Invalid()
    with pytest.raises(GarbledError, match=f"a message of /commands is no {COMMANDS}"):
        robot.take()


def test_one_domain_has_one_address_in_a_process(links):
    other = Ros2Link(Ros2Network(LOOPBACK.domain), ("/commands", COMMANDS))
    with pytest.raises(SettingError, match="is open in this process with another address or other peers"):
        other.open()


def test_address_that_this_computer_lacks_is_refused():
    link = Ros2Link(Ros2Network(LOOPBACK.domain + 1, "203.0.113.1"), ("/commands", COMMANDS))
    with pytest.raises(SettingError, match="this computer cannot join domain"):
        link.open()
    assert LOOPBACK.domain + 1 not in module._domains


def test_missing_library_is_named_with_its_extra(monkeypatch):
    monkeypatch.setattr("palpate.drivers.ros2.link.find_spec", lambda name: None)
    with pytest.raises(SettingError, match=r"cyclonedds is not installed.*pip install 'palpate\[ros2\]'"):
        Ros2Link(LOOPBACK, ("/commands", COMMANDS)).open()
