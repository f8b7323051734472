"""Between two threads: the control loop, which never waits long, and the agent, which may take its time.

A decision that is not there when it is due is replaced by a rest: the peg is pressed on the plate where it stands,
under the same compliant control, supervised and recorded as any action, and the decision is taken when the next one is
due. An agent that takes longer than a limit ends the trial, with the arm stopped and the rig latched.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from typing_extensions import override

from palpate.core.control_loop import LoopObserver
from palpate.core.errors import DeviceError
from palpate.core.policy import Action, Decision, FixedPolicy, Observation

LATE: Final = "late"
"""Source of a rest, in the records of a trial."""
REST: Final = Decision(Action("rest", (0.0, 0.0)), None, LATE)
_GRACE_S: Final = 0.003
"""How long the loop waits in the tick of a decision; less than half of a tick."""
_PATIENCE_S: Final = 5.0
_NS: Final = 1_000_000_000


class LateAgentError(DeviceError):
    """An agent took longer for a decision than the arm may be left to it."""

    def __init__(self, problem: str) -> None:
        super().__init__("agent", problem)

    def __reduce__(self) -> tuple[type[LateAgentError], tuple[str]]:
        return type(self), (str(self).removeprefix("agent: "),)


class Handover(FixedPolicy, LoopObserver):
    """The policy and an observer to the loop; a desk where decisions are handed in to the agent.

    Args:
        limit_s: How long the agent may take for a decision, by the run's clock.

    Attributes:
        look: Gives what the agent is shown when a decision is due; called by the loop.
    """

    def __init__(self, limit_s: float, grace_s: float = _GRACE_S) -> None:
        super().__init__()
        self._limit_ns, self._grace_s = round(limit_s * _NS), grace_s
        self.look: Callable[[], Any] = lambda: None
        self._turn = threading.Condition()
        self._decision: Decision | None = None
        self._shown: list[Any] = []
        self._asked_ns: int | None = None
        self._time_ns = 0
        self._error: BaseException | None = None
        self._over, self._left = True, False
        self.late_decisions = 0

    # The loop's side.

    @override
    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        super().begin_trial(trial, rng)
        self._decision = self._asked_ns = None
        self.late_decisions = 0

    def choose(self, observation: Observation) -> Decision:
        """The agent's decision; a rest where there is none in time."""
        with self._turn:
            if self._decision is None and self._asked_ns is None:
                self._asked_ns = self._time_ns
                self._shown.append(self.look())
                self._turn.notify_all()
            if not self._left:
                self._turn.wait_for(lambda: self._decision is not None or self._left, self._grace_s)
            decision, self._decision = self._decision, None
            if decision is None:
                self.late_decisions += 1
                return REST
            return decision

    @override
    def clock_read(self, deadline_ns: int, time_ns: int) -> None:
        """A tick begins.

        Raises:
            LateAgentError: The agent has taken longer than the limit.
        """
        self._time_ns, asked_ns = time_ns, self._asked_ns
        if asked_ns is not None and not self._left and time_ns - asked_ns > self._limit_ns:
            took = f"no decision for {(time_ns - asked_ns) / _NS:.3f} s; {self._limit_ns / _NS:g} s are allowed"
            raise LateAgentError(took)

    def end(self, shown: Any, error: BaseException | None = None) -> None:
        """The trial is over: this is the last that the agent is shown, or an error ended it."""
        with self._turn:
            self._over, self._error, self._asked_ns = True, error, None
            self._shown = [] if error is not None else [shown]
            self._turn.notify_all()

    # The agent's side.

    @property
    def over(self) -> bool:
        """Whether no trial is under way."""
        return self._over

    def begin(self) -> None:
        """A trial is asked for."""
        with self._turn:
            self._over, self._error, self._left = False, None, False
            self._shown.clear()

    def give(self, decision: Decision) -> None:
        """What the loop shall do next."""
        with self._turn:
            self._decision, self._asked_ns = decision, None
            self._turn.notify_all()

    def wait(self) -> Any:
        """What the agent is shown next."""
        with self._turn:
            self._turn.wait_for(lambda: self._shown or self._error is not None or self._over)
            if self._error is not None:
                error, self._error = self._error, None
                raise error
            return self._shown.pop() if self._shown else None

    def leave(self, stop: Callable[[], None]) -> None:
        """The agent wants no more of this trial: the arm is stopped, whatever the loop is at, until the trial is over.

        Args:
            stop: Stops the arm; called again and again, for making ready for a trial sets it free.
        """
        with self._turn:
            self._left = True
            self._turn.notify_all()
        deadline_s = time.monotonic() + _PATIENCE_S
        while not self._over and time.monotonic() < deadline_s:
            stop()
            with self._turn:
                self._turn.wait_for(lambda: self._over, _GRACE_S)
        self._shown.clear()
        self._error = None
