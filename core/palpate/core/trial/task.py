"""The interface between a task and the loop, the supervisor, the recorder and a replay."""

from abc import abstractmethod
from typing import Protocol

from palpate.core.policy import Observation
from palpate.core.ports import JointCommand, Snapshot, Vector3
from palpate.core.trial.constraints import CommandOverride, PhaseConstraints, Trip
from palpate.core.trial.report import TrialReport, TrialSetup


class Task(Protocol):
    """An arm's behaviour in a trial: each tick, it turns a snapshot into a joint command, without I/O or a clock.

    A task must be a function of its configuration, the trial's setup and the snapshots; otherwise it cannot be
    replayed. It is reused for every trial; :meth:`begin` resets it.

    Attributes:
        constraints: Current constraints on contact and position, for the supervisor.
        tip_m: Tip position from the encoders at the last tick, (3,), task frame.
        turned_rad: Tool tilt, and turn about its axis, from the encoders, (2,).
    """

    constraints: PhaseConstraints
    tip_m: Vector3
    turned_rad: tuple[float, float] = (0.0, 0.0)

    @abstractmethod
    def begin(self, setup: TrialSetup) -> None:
        """Prepare for a trial; the next :meth:`sense` is its first tick."""

    @abstractmethod
    def sense(self, snapshot: Snapshot) -> Observation | None:
        """Process a snapshot in the first half of a tick; :meth:`act` is the second half.

        Returns:
            The observation for a policy's choice in the second half; None except at decision ticks.

        Raises:
            DeviceError: The number of joint angles is wrong, or the pose is unknown at the beginning of the trial.
        """

    def choose(self) -> None:
        """Let the policy choose, based on the observation from :meth:`sense`; not called for tasks without a policy."""
        return

    @abstractmethod
    def act(self) -> JointCommand:
        """Return the arm's command, in the second half of a tick."""

    @abstractmethod
    def interrupt(self) -> None:
        """End the trial as soon as possible, and any later trial immediately. A signal handler may call this.

        The first tick that detects it records the :data:`~palpate.core.trial.report.INTERRUPT` event, at which a replay
        also interrupts the trial.
        """

    @abstractmethod
    def tripped(self, trip: Trip) -> None:
        """End the trial after a supervisor trip."""

    @abstractmethod
    def clamped(self, command_override: CommandOverride) -> None:
        """Record that the supervisor changed a command."""

    @abstractmethod
    def conclude(self) -> None:
        """Finish the trial after its last tick; its results no longer change."""

    @property
    @abstractmethod
    def report(self) -> TrialReport:
        """Return the report on the current or latest trial; setting its outcome ends the trial."""

    @property
    @abstractmethod
    def filter_state(self) -> list[float]:
        """Return the filter state; after :meth:`begin`, it is the initial state stored in the log."""
