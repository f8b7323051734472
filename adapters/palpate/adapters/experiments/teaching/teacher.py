"""A person as the policy of a trial."""

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from typing_extensions import override

from palpate.adapters.experiments.evaluation import FIRST_EVALUATION_TRIAL
from palpate.adapters.experiments.teaching.examples_file import Shown
from palpate.adapters.experiments.teaching.hand import Hand
from palpate.adapters.log import PERSON
from palpate.core.control_loop import LoopObserver
from palpate.core.errors import DeviceError
from palpate.core.policy import Action, Decision, FixedPolicy, Observation
from palpate.core.ports import AppliedCommand, ArmCommand, DeviceDecorator, JointCommand
from palpate.core.trial import Task

_REST: Final = Action("rest", (0.0, 0.0))


class Teacher(FixedPolicy, LoopObserver):
    """Asks a hand for each step, and keeps what was shown.

    Whoever leads the tool by pushing it disturbs what it feels. So then an example is the first step of a push, with
    the state that was felt before it.

    Args:
        tell: Is given the trial's number, the observation and its state ahead of each question.
        guided: Whether the person pushes the tool.

    Attributes:
        shown: The examples of the trial.
        task: Runs the trial; it is asked to end it when the person does.
        on_the_way: Whether the arm is on its way to the ready pose.
    """

    def __init__(
        self,
        hand: Hand,
        states: Sequence[str],
        actions: Sequence[Action],
        tell: Callable[[Observation, str], None],
        *,
        guided: bool = False,
    ) -> None:
        super().__init__()
        self.hand, self._states, self._actions, self._tell = hand, tuple(states), tuple(actions), tell
        self._guided = guided
        self.shown: list[Shown] = []
        self.task: Task | None = None
        self.on_the_way = False
        self._quiet: int | None = None
        self._trial = 0

    @override
    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        super().begin_trial(trial, rng)
        self.shown, self._quiet, self._trial = [], None, trial - FIRST_EVALUATION_TRIAL
        self.on_the_way = False

    def choose(self, observation: Observation) -> Decision:
        """What the person shows; a rest where that is nothing.

        Raises:
            DeviceError: What the person teaches with is gone.
        """
        self._tell(observation, self._states[observation.state])
        way = self.hand.step(observation)
        state = self._quiet if self._guided else observation.state
        self._quiet = observation.state if way is None else None
        if way is None:
            return Decision(_REST, None, PERSON)
        if state is not None:
            self.shown.append(
                Shown(self._trial, observation.action_number, self._states[state], self._actions[way].name)
            )
        # The log then has the example, too.
        return Decision(self._actions[way], way, PERSON, (float(-1 if state is None else state),))

    @override
    def clock_read(self, deadline_ns: int, time_ns: int) -> None:
        """A tick begins: where the arm moves by itself, a button that is let go ends the trial.

        Raises:
            DeviceError: What the person teaches with is gone.
        """
        task, hand = self.task, self.hand
        if task is not None and (hand.ended() or (not hand.held and task.expectation.area is None)):
            task.interrupt()


class HeldArm(DeviceDecorator, ArmCommand):
    """An arm that takes commands only while the teacher's hand holds the button, on its way to the ready pose."""

    def __init__(self, arm: ArmCommand, teacher: Teacher) -> None:
        super().__init__(arm)
        self._arm, self._teacher = arm, teacher

    def send(self, command: JointCommand) -> AppliedCommand:
        """Pass a command on, unless the button was let go."""
        if self._teacher.on_the_way and not self._teacher.hand.held:
            self._arm.stop()
            raise DeviceError("teach", "the button was let go on the way to the ready pose: begin again and hold it")
        return self._arm.send(command)

    def stop(self) -> None:
        """Stop the arm."""
        self._arm.stop()
