"""What the phases of an insertion share of their trial, and how it ends."""

from typing_extensions import override

from palpate.core.ports import PERIOD_S
from palpate.core.tasks.contact import TrialState
from palpate.core.tasks.insertion.agent import Agent
from palpate.core.trial import Measurement, Outcome, TrialSetup


class InsertionState(TrialState):
    """Where a trial stands.

    Args:
        agent: What learns from the trial's end.

    Attributes:
        explore_start: Tick of the first contact; 0 before.
        hole_tick: Tick in which the hole was found; None before, and after a drop that was none.
        surface_m: Height of the plate's surface below the nominal plane, as far as it was found.
        slack_m: How far it may lie elsewhere; 0 where the plate was touched.
        edge_m: How far it may lie higher, where the touch was so brief that it may have been the hole's edge.
    """

    def __init__(self, agent: Agent, measurement: Measurement) -> None:
        super().__init__()
        self._agent, self._measurement = agent, measurement

    @override
    def begin(self, setup: TrialSetup) -> None:
        """A trial begins."""
        super().begin(setup)
        self.explore_start = 0
        self.hole_tick: int | None = None
        self.surface_m = self.slack_m = self.edge_m = 0.0

    def agent_begun(self) -> None:
        """The agent has begun the trial, too."""
        # The list is the living one: an observer sees a decision as it is made.
        self.report.temperature, self.report.decisions = self._agent.temperature, self._agent.decisions

    @property
    def exploration_s(self) -> float:
        """Time from the first contact to the hole, or until now without it."""
        end = self.tick if self.hole_tick is None else self.hole_tick
        return (end - self.explore_start) * PERIOD_S

    def end_inserted(self, depth_m: float) -> None:
        """The trial ends with the peg at this depth in the hole."""
        self._agent.reached_goal()
        self.report.depth_m = depth_m
        self.end(Outcome.INSERTED, f"depth {depth_m * 1e3:.3f} mm")

    @override
    def end(self, outcome: Outcome, detail: str) -> None:
        measured = self._measurement
        if outcome in (Outcome.TIME_LIMIT, Outcome.WEDGED, Outcome.UNCERTAIN_DEPTH, Outcome.FORCE_LIMIT):
            # No goal, but it did cost: an action that always ends a trial like this must not look as good as new.
            self._agent.gave_up(measured.position_m, *measured.filtered_wrench_at_tip())
        if self.report.depth_m == 0.0:
            self.report.depth_m = max(measured.tip_depth_m - self.surface_m, 0.0)
        if self.explore_start:
            self.report.exploration_time_s = self.exploration_s
        self.report.actions = len(self._agent.decisions)
        super().end(outcome, detail)
