"""What the phases of a trial share of it, and how it ends."""

from __future__ import annotations

from dataclasses import replace

from palpate.core.policy import Observation
from palpate.core.ports import PERIOD_S, Snapshot
from palpate.core.tasks.insertion.agent import Agent
from palpate.core.trial import Event, Expectation, Measurement, Outcome, Phase, TrialReport, TrialSetup, Trip


class TrialState:
    """Where a trial stands.

    Args:
        agent: What learns from the trial's end.
        measurement: The newest tick.
        axial_N_per_m: Stiffness of the gripper along the tool axis.

    Attributes:
        report: The account of the trial.
        phase: Where in the trial it is.
        expectation: What is expected of the world in this phase.
        tick: Control tick of the trial.
        snapshot: What was sensed in it.
        observation: What an action is to be chosen by in this tick; None in the many ticks without a choice.
        explore_start: Tick of the first contact; 0 before.
        hole_tick: Tick in which the hole was found; None before, and after a drop that was none.
        surface_m: Height of the plate's surface below the nominal plane, as far as it was found.
        slack_m: How far it may lie elsewhere; 0 where the plate was touched.
        edge_m: How far it may lie higher, where the touch was so brief that it may have been the hole's edge.
    """

    def __init__(self, agent: Agent, measurement: Measurement, axial_N_per_m: float) -> None:
        self._agent, self._measurement, self._axial_N_per_m = agent, measurement, axial_N_per_m
        self.report = TrialReport(TrialSetup(0, 0, (0.0, 0.0)))
        self.phase = Phase.DONE
        self.snapshot: Snapshot

    def begin(self, setup: TrialSetup) -> None:
        """A trial begins; the agent has begun it."""
        # The lists are the living ones: an observer sees a decision as it is made.
        self.report = TrialReport(setup, temperature=self._agent.temperature, decisions=self._agent.decisions)
        self.phase = Phase.LIFT
        self._reset()

    def _reset(self) -> None:
        # A trial may begin with the peg still in the hole of the one before.
        self.expectation = Expectation(contact=True)
        self.observation: Observation | None
        self.tick = self.explore_start = 0
        self.hole_tick: int | None = None
        self.surface_m = self.slack_m = self.edge_m = 0.0

    def enter(self, phase: Phase, expectation: Expectation) -> None:
        """Another phase begins."""
        self.phase, self.expectation = phase, expectation
        self.event("phase", phase.value)

    def event(self, name: str, detail: str = "") -> None:
        """Something happened in this tick."""
        self.report.events.append(Event(self.tick, name, detail))

    def doubt(self, trip: Trip) -> None:
        """The supervisor trips in this very tick; without one the trial ends in the next."""
        self.event("doubt", f"{trip.reason.name}: {trip.text}")
        self.expectation = replace(self.expectation, doubt=trip)

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

    def end(self, outcome: Outcome, detail: str) -> None:
        """The trial ends like this."""
        measured = self._measurement
        self.report.outcome = outcome
        if outcome in (Outcome.TIME_LIMIT, Outcome.JAMMED, Outcome.FORCE_LIMIT):
            # No goal, but it did cost: an action that always ends a trial like this must not look as good as new.
            self._agent.gave_up(measured.position_m, *measured.filtered_wrench_at_tip())
        if self.report.depth_m == 0.0:
            self.report.depth_m = max(measured.tip_depth_m(self._axial_N_per_m) - self.surface_m, 0.0)
        if self.explore_start:
            self.report.exploration_time_s = self.exploration_s
        self.report.actions = len(self._agent.decisions)
        self.event("end", f"{outcome.value}: {detail}")
        self.phase = Phase.DONE
