"""Where a trial of a task that touches stands, and how it ends."""

from __future__ import annotations

from dataclasses import replace
from enum import Enum

from palpate.core.policy import Observation
from palpate.core.ports import Snapshot
from palpate.core.trial import Event, Expectation, Outcome, Phase, TrialReport, TrialSetup, Trip


class TrialState:
    """What the phases of a trial share of it.

    Attributes:
        phase: Where in the trial it is; a task's own phases are members of an enumeration of its own.
        noise: Deviation of each channel of the force sensor, (6,), N and N m, while it was tared.
        observation: What an action is to be chosen by in this tick; None in ticks without a choice.
    """

    def __init__(self) -> None:
        self.report: TrialReport
        self.phase: Enum
        self.tick: int
        self.noise: tuple[float, ...]
        self.snapshot: Snapshot
        self.observation: Observation | None

    def begin(self, setup: TrialSetup) -> None:
        """A trial begins."""
        self.report = TrialReport(setup)
        self.phase = Phase.LIFT
        # A trial may begin with the tool still where the one before left it.
        self.expectation = Expectation(contact=True)

    def enter(self, phase: Enum, expectation: Expectation) -> None:
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

    def end(self, outcome: Outcome, detail: str) -> None:
        """The trial ends like this."""
        self.report.outcome = outcome
        self.event("end", f"{outcome.value}: {detail}")
        self.phase = Phase.DONE
