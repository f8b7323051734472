import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from palpate.adapters.experiments.teaching import Gamepad
from palpate.core.errors import ConfigurationError, DeviceError
from palpate.core.policy import COMPASS_NAMES
from tests.unit.adapters.experiments.teaching.gamepad_pipe import AXIS, BUTTON, INITIAL, Pad
from tests.unit.adapters.samples import observation

HERE = observation()


@pytest.fixture
def pad(tmp_path: Path) -> Iterator[Pad]:
    made = Pad(tmp_path / "js0")
    yield made
    os.close(made.fd)


@pytest.mark.parametrize(
    ("right", "back", "name"),
    [(0, -32767, "+x"), (32767, 0, "+y"), (-23000, -23000, "+x-y"), (20000, 30000, "-x+y"), (9000, -9000, None)],
)
def test_on_a_rig_the_newest_state_counts_and_without_the_button_it_is_a_rest(
    pad: Pad, right: int, back: int, name: str | None
) -> None:
    with Gamepad(str(pad.path), 4) as gamepad:
        for axis, value in ((0, right), (1, back)):
            pad.send(AXIS | INITIAL, axis, value)
        pad.send(BUTTON, 3, 1)
        assert (gamepad.held, gamepad.step(HERE)) == (False, None)
        pad.send(BUTTON, 4, 1)
        assert gamepad.step(HERE) == (None if name is None else COMPASS_NAMES.index(name))
        pad.send(BUTTON, 4, 0)
        assert (gamepad.held, gamepad.step(HERE)) == (False, None)


def test_a_trial_begins_when_the_button_is_pressed_anew_and_a_record_may_come_in_two_parts(pad: Pad) -> None:
    with Gamepad(str(pad.path), 4) as gamepad:
        pad.send(BUTTON | INITIAL, 4, 1)
        torn = pad.event(BUTTON, 4, 0)
        os.write(pad.fd, torn[:3])
        assert gamepad.held
        os.write(pad.fd, torn[3:] + pad.event(BUTTON, 4, 1))
        gamepad.end()
        gamepad.wait()
        assert gamepad.held


def test_in_the_simulator_a_step_waits_for_the_stick_and_is_as_slow_as_an_action(pad: Pad) -> None:
    slept: list[float] = []

    def sleep(seconds: float) -> None:
        slept.append(seconds)
        pad.send(AXIS, 6, -32767)

    with Gamepad(str(pad.path), None, action_s=0.25, sleep=sleep) as gamepad:
        assert gamepad.held
        assert gamepad.step(HERE) == COMPASS_NAMES.index("-y")
    assert slept == [0.25]


def test_a_person_who_pushes_the_tool_leads_it_while_the_button_is_held(pad: Pad) -> None:
    with Gamepad(str(pad.path), 4, guide_N=3.0) as gamepad:
        pushed = replace(HERE, force_N=(-3.0, 0.5, -5.0))
        assert gamepad.step(pushed) is None
        pad.send(BUTTON, 4, 1)
        assert gamepad.step(pushed) == COMPASS_NAMES.index("-x")
        assert gamepad.step(replace(HERE, force_N=(2.0, 2.0, -5.0))) is None


def test_a_device_without_end_is_no_gamepad() -> None:
    with Gamepad("/dev/zero", 4) as gamepad, pytest.raises(DeviceError, match="gives records without end"):
        _ = gamepad.held


def test_a_gamepad_that_is_gone_is_a_device_s_error(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="/dev/input/js0"):
        Gamepad(str(tmp_path / "js9"), 4)
    pad = Pad(tmp_path / "js0")
    with Gamepad(str(pad.path), 4) as gamepad:
        os.close(pad.fd)
        with pytest.raises(DeviceError, match="is gone"):
            gamepad.step(HERE)
