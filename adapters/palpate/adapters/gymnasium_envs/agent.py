"""Communication between two threads: the control loop and an agent that chooses actions.

On a rig, the loop never waits for long. If a decision is late, the loop inserts a pause, which is supervised and
recorded as an action: the peg stays pressed in place under the same compliant control. The late decision is used when
the next one is due. An agent that exceeds a limit ends the trial; the arm is stopped and the rig latched. In the
simulator, time stops until the agent has decided.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from queue import Empty, SimpleQueue
from typing import Any, Final

from palpate.core.control_loop import LoopObserver
from palpate.core.errors import DeviceError
from palpate.core.policy import Action, Decision, FixedPolicy, Observation

LATE: Final = "late"
"""Source of a pause, as it appears in a trial's records."""
PAUSE: Final = Decision(Action("rest", (0.0, 0.0)), None, LATE)
GRACE_S: Final = 0.003
"""Maximum time for which the loop on a rig waits for a decision; less than half a tick."""
_NS: Final = 1_000_000_000


class LateAgentError(DeviceError):
    """An agent exceeded the time limit for a decision."""

    def __init__(self, problem: str) -> None:
        super().__init__("agent", problem)

    def __reduce__(self) -> tuple[type[LateAgentError], tuple[str]]:
        return type(self), (str(self).removeprefix("agent: "),)


class LeftError(Exception):
    """The agent has left a trial in the simulator."""


class Agent(FixedPolicy, LoopObserver):
    """Policy and loop observer for trials in which another thread chooses the actions.

    Args:
        limit_s: Time limit for a decision, on the run's clock.
        grace_s: Maximum time for which the loop waits for a decision; None for no limit.

    Attributes:
        look: Function that returns the agent's view when a decision is due; called in the loop's thread.
        shown: Views for the agent, or the error that ended the trial.
    """

    def __init__(self, limit_s: float = inf, grace_s: float | None = None) -> None:
        super().__init__()
        self._limit_ns, self._grace_s = limit_s * _NS, grace_s
        self.look: Callable[[], Any] = lambda: None
        self.new_trial()

    def new_trial(self) -> None:
        """Discard remaining data from the previous trial."""
        self.shown, self._given = SimpleQueue[Any](), SimpleQueue[Decision]()
        self._requested_ns: int | None = None
        self._time_ns = self.late_decisions = 0
        self.left = False

    def give(self, decision: Decision) -> None:
        """Pass the next decision to the loop."""
        self._given.put(decision)

    def leave(self) -> None:
        """Stop waiting. In the simulator, the trial then ends; on a rig, it pauses until the arm is stopped."""
        self.left = True
        self._given.put(PAUSE)

    def choose(self, observation: Observation) -> Decision:
        """Return the agent's decision, or a pause if none arrives in time."""
        if self._requested_ns is None:
            self._requested_ns = self._time_ns
            self.shown.put(self.look())
        try:
            decision = PAUSE if self.left else self._given.get(timeout=self._grace_s)
        except Empty:
            self.late_decisions += 1
            return PAUSE
        self._requested_ns = None
        return decision

    def clock_read(self, deadline_ns: int, time_ns: int) -> None:
        """Begin a tick; raise LateAgentError if the agent is late, or LeftError if it has left the trial."""
        if self.left and self._grace_s is None:
            raise LeftError
        self._time_ns, requested_ns = time_ns, self._requested_ns
        if requested_ns is None or self.left or time_ns - requested_ns <= self._limit_ns or not self._given.empty():
            return
        took = f"no decision for {(time_ns - requested_ns) / _NS:.3f} s; {self._limit_ns / _NS:g} s are allowed"
        raise LateAgentError(took)
