"""Trial state for a task with contact."""

from __future__ import annotations

from dataclasses import replace
from enum import Enum

from palpate.core.policy import Observation
from palpate.core.ports import Snapshot
from palpate.core.trial import Event, Outcome, Phase, PhaseConstraints, TrialReport, TrialSetup, Trip


class TrialState:
    """State shared by a trial's phases.

    Attributes:
        phase: The current phase; a task may define its own phases in a separate enumeration.
        noise: Standard deviation of each force sensor channel during taring, (6,), N and N m.
        observation: Observation for choosing an action at the current tick; None except at decision ticks.
    """

    def __init__(self) -> None:
        self.report: TrialReport
        self.phase: Enum
        self.tick: int
        self.noise: tuple[float, ...]
        self.snapshot: Snapshot
        self.observation: Observation | None

    def begin(self, setup: TrialSetup) -> None:
        """Reset the state for a new trial."""
        self.report = TrialReport(setup)
        self.phase = Phase.LIFT
        # A trial may begin with the tool where the previous one left it.
        self.constraints = PhaseConstraints(contact=True)

    def enter(self, phase: Enum, constraints: PhaseConstraints) -> None:
        """Enter a different phase."""
        self.phase, self.constraints = phase, constraints
        self.event("phase", phase.value)

    def event(self, name: str, detail: str = "") -> None:
        """Record an event at the current tick."""
        self.report.events.append(Event(self.tick, name, detail))

    def mismatch(self, trip: Trip) -> None:
        """Report a mismatch: the supervisor trips at the same tick; without it, the trial ends at the next tick."""
        self.event("mismatch", f"{trip.reason.name}: {trip.text}")
        self.constraints = replace(self.constraints, mismatch=trip)

    def end(self, outcome: Outcome, detail: str) -> None:
        """End the trial with the given outcome."""
        self.report.outcome = outcome
        self.event("end", f"{outcome.value}: {detail}")
        self.phase = Phase.DONE
