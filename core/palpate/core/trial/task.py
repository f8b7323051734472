"""The seam between a task and whatever runs it: the loop, the supervisor, the recorder and a replay use no more."""

from abc import abstractmethod
from typing import Protocol

from palpate.core.policy import Observation
from palpate.core.ports import JointCommand, Snapshot, Vector3
from palpate.core.trial.expectation import Expectation, Intervention, Trip
from palpate.core.trial.report import TrialReport, TrialSetup


class Task(Protocol):
    """What an arm does in a trial: one snapshot in, one joint command out, tick by tick. Without I/O and clock.

    A task is a function of its configuration, of the trial's setup and of the snapshots, or it cannot be replayed.
    It is used trial after trial; :meth:`begin` clears what the one before left.

    Attributes:
        expectation: What it expects of the world at present, for the supervisor.
        tip_m: Tip according to the encoders, (3,), task frame, as of the last tick.
        turned_rad: How the tool leans, and by how much it is turned about its axis, by the encoders, (2,).
    """

    expectation: Expectation
    tip_m: Vector3
    turned_rad: tuple[float, float] = (0.0, 0.0)

    @abstractmethod
    def begin(self, setup: TrialSetup) -> None:
        """Prepare for a trial; the next :meth:`sense` is its first tick."""

    @abstractmethod
    def sense(self, snapshot: Snapshot) -> Observation | None:
        """The first half of a tick: what was sensed in; :meth:`act` is the second.

        Returns:
            What a policy will choose an action by in the second half; None in ticks without a choice.

        Raises:
            DeviceError: It is not known where the arm is when the trial begins, so there is nothing to command.
        """

    def choose(self) -> None:
        """Let the policy choose by what :meth:`sense` returned; tasks without a policy are never asked."""
        return

    @abstractmethod
    def act(self) -> JointCommand:
        """The second half of a tick: what the arm shall do."""

    @abstractmethod
    def interrupt(self) -> None:
        """End the trial as soon as that makes sense, and any later one at once. Safe to call from a signal handler.

        The tick in which this is first seen leaves an event :data:`~palpate.core.trial.report.INTERRUPT`: a replay
        interrupts the trial there.
        """

    @abstractmethod
    def tripped(self, trip: Trip) -> None:
        """The supervisor has taken over: the trial is over."""

    @abstractmethod
    def clamped(self, intervention: Intervention) -> None:
        """The supervisor has changed a command."""

    @abstractmethod
    def conclude(self) -> None:
        """The loop is done with the trial; nothing that it came to changes any more."""

    @property
    @abstractmethod
    def report(self) -> TrialReport:
        """The living account of the trial that runs, or of the last one; its outcome ends the trial."""

    @property
    @abstractmethod
    def filter_state(self) -> list[float]:
        """Memory of the filters; after :meth:`begin` what a trial starts with, as its log holds it."""
