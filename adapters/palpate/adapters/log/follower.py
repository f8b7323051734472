"""Reads a task's report as the trial goes on, and tells what is new in it."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol, TypeAlias

from palpate.adapters.log.records import DecisionEntry, EventEntry, ReinforcementEntry
from palpate.adapters.log.schema import DECISION, EVENT, REINFORCEMENT, ChannelKind
from palpate.core.insertion.trial import TrialReport

_Entry: TypeAlias = EventEntry | DecisionEntry | ReinforcementEntry


class HasReport(Protocol):
    """Whoever runs the trial."""

    @property
    def report(self) -> TrialReport:
        """The account of the trial so far."""


class ReportFollower:
    """Follows one trial.

    Args:
        task: Runs it. Until it begins this trial its report is that of the one before: nothing in there is news.
    """

    def __init__(self, task: HasReport) -> None:
        self._task, self._report = task, task.report
        self._events, self._decisions = len(self._report.events), len(self._report.decisions)
        self._settled = self._decisions

    @property
    def has_news(self) -> bool:
        """Whether anything was reported since it was last asked; cheap, for it is asked every tick."""
        report = self._task.report
        known = len(report.events) == self._events and len(report.decisions) == self._decisions
        return not known or report is not self._report

    def news(self, tick: int, *, final: bool = False, counterfactual: bool = False) -> list[tuple[ChannelKind, object]]:
        """Records of what was reported since this was last asked, each with its channel.

        Args:
            tick: The tick that is under way.
            final: It is not asked again: what a decision earned is told even if none came after it.
            counterfactual: Mark the records as no observation.
        """
        report, found = self._task.report, list[tuple[ChannelKind, _Entry]]()
        if report is not self._report:
            self._report = report
            self._events = self._decisions = self._settled = 0
        if len(report.events) > self._events:
            for event in report.events[self._events :]:
                found.append((EVENT, EventEntry(tick=event.tick, name=event.name, detail=event.detail)))
            self._events = len(report.events)
        if len(report.decisions) > self._decisions or (final and self._settled < self._decisions):
            self._follow_decisions(report, tick, found)
        if counterfactual:
            return [(kind, replace(entry, counterfactual=True)) for kind, entry in found]
        return [*found]

    def _follow_decisions(self, report: TrialReport, tick: int, found: list[tuple[ChannelKind, _Entry]]) -> None:
        for number, decision in enumerate(report.decisions[self._settled :], start=self._settled):
            if number >= self._decisions:
                chosen = DecisionEntry(
                    tick=decision.tick,
                    number=number,
                    symbol=decision.symbol,
                    state=decision.state,
                    action=decision.action,
                    source=decision.source,
                    temperature=report.temperature,
                )
                found.append((DECISION, chosen))
            if decision.reinforcement is not None:
                earned = ReinforcementEntry(tick=tick, number=number, reinforcement=decision.reinforcement)
                found.append((REINFORCEMENT, earned))
                self._settled = number + 1
        self._decisions = len(report.decisions)
