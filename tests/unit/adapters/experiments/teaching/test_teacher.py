from dataclasses import replace

import numpy as np
import pytest

from palpate.adapters.config import RunConfig
from palpate.adapters.experiments import task_actions
from palpate.adapters.experiments.teaching import Hand, Shown, Teacher
from palpate.adapters.experiments.teaching.teacher import HeldArm
from palpate.core.errors import DeviceError
from palpate.core.policy import Observation
from palpate.core.ports import JointCommand
from tests.unit.adapters.samples import observation

STATES = ("a", "b", "c")
HERE = JointCommand((0.0,) * 6)


class Scripted(Hand):
    """Shows these steps, one after the other, and holds the button when told."""

    def __init__(self, *steps: int | None) -> None:
        self.steps, self.held_now = list(steps), True

    def wait(self) -> None:
        self.held_now = True

    @property
    def held(self) -> bool:
        return self.held_now

    def step(self, observation: Observation) -> int | None:
        return self.steps.pop(0)


@pytest.mark.parametrize(
    ("guided", "kept"),
    [
        (False, [(0, "a", "+x"), (2, "c", "+y"), (3, "a", "+y"), (5, "b", "-x")]),
        # Of a push the first step, by what was felt at the rest before it; none where there was no rest.
        (True, [(2, "b", "+y"), (5, "a", "-x")]),
    ],
)
def test_examples_are_the_steps_that_were_shown(guided: bool, kept: list[tuple[int, str, str]]) -> None:
    hand = Scripted(0, None, 2, 2, None, 4)
    teacher = Teacher(hand, STATES, task_actions(RunConfig()), lambda seen, state: None, guided=guided)
    teacher.begin_trial(500_003, np.random.default_rng(0))
    chosen = [
        teacher.choose(replace(observation(action_number=number), state=state))
        for number, state in enumerate((0, 1, 2, 0, 0, 1))
    ]
    assert teacher.shown == [Shown(3, *one) for one in kept]
    assert [decision.index for decision in chosen] == [0, None, 2, 2, None, 4]
    assert {decision.source for decision in chosen} == {"person"}
    assert chosen[1].action.displacement_m == (0.0, 0.0)


def test_on_the_way_to_the_ready_pose_a_button_that_is_let_go_stops_the_arm() -> None:
    class Arm:
        stops = 0

        def send(self, command: JointCommand) -> str:
            return "sent"

        def stop(self) -> None:
            self.stops += 1

    hand, arm = Scripted(), Arm()
    teacher = Teacher(hand, STATES, task_actions(RunConfig()), lambda seen, state: None)
    held = HeldArm(arm, teacher)  # type: ignore[arg-type]
    hand.held_now = False
    assert held.send(HERE) == "sent"
    teacher.on_the_way = True
    with pytest.raises(DeviceError, match="was let go"):
        held.send(HERE)
    assert arm.stops == 1
    hand.held_now = True
    assert (held.send(HERE), arm.stops) == ("sent", 1)
