"""State shared by an insertion's phases, and the end of an insertion."""

from typing_extensions import override

from palpate.core.ports import PERIOD_S
from palpate.core.tasks.contact import TrialState
from palpate.core.tasks.insertion.agent import Agent
from palpate.core.trial import Measurement, Outcome, TrialSetup


class InsertionState(TrialState):
    """Insertion trial state.

    Args:
        agent: Agent that learns from the end of the trial.

    Attributes:
        explore_start: Tick at the first contact; 0 until then.
        hole_tick: Tick at which the hole was found; None before that, and after a false drop.
        surface_m: Estimated depth of the plate's surface below the nominal plane.
        slack_m: Uncertainty in that depth; 0 if the plate was touched.
        claimed: True if the policy has reported the peg as inserted; the trial then ends with the verified result.
        edge_m: Distance by which the surface may be higher, if the contact was brief enough to be the hole's edge.
    """

    def __init__(self, agent: Agent, measurement: Measurement) -> None:
        super().__init__()
        self._agent, self._measurement = agent, measurement

    def begin(self, setup: TrialSetup) -> None:
        """Reset the state for a new trial."""
        super().begin(setup)
        self.explore_start = 0
        self.hole_tick: int | None = None
        self.claimed = False
        self.surface_m = self.slack_m = self.edge_m = 0.0

    def agent_begun(self) -> None:
        """Copy decisions and temperature to the report after the agent has begun the trial."""
        # The list is shared: an observer sees each decision when it is made.
        self.report.temperature, self.report.decisions = self._agent.temperature, self._agent.decisions

    @property
    def exploration_s(self) -> float:
        """Return the time from the first contact until the hole was found, or until the current tick."""
        end = self.tick if self.hole_tick is None else self.hole_tick
        return (end - self.explore_start) * PERIOD_S

    def end_inserted(self, depth_m: float) -> None:
        """End the trial with the peg at the given depth in the hole."""
        self._agent.reached_goal()
        self.report.depth_m = depth_m
        self.end(Outcome.INSERTED, f"depth {depth_m * 1e3:.3f} mm")

    @override
    def end(self, outcome: Outcome, detail: str) -> None:
        measured = self._measurement
        if outcome in (Outcome.TIME_LIMIT, Outcome.WEDGED, Outcome.UNCERTAIN_DEPTH, Outcome.FORCE_LIMIT):
            # The goal was not reached but the action has a cost: an action that ends trials must not keep its initial
            # value.
            self._agent.gave_up(measured.position_m, *measured.filtered_wrench_at_tip())
        if self.report.depth_m == 0.0:
            self.report.depth_m = max(measured.tip_depth_m - self.surface_m, 0.0)
        if self.explore_start:
            self.report.exploration_time_s = self.exploration_s
        self.report.actions = len(self._agent.decisions)
        super().end(outcome, detail)
