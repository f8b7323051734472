"""What a task reports is told once, in order, and nothing of another trial."""

from __future__ import annotations

from palpate.adapters.log.follower import ReportFollower
from palpate.adapters.log.records import DecisionEntry, EventEntry, ReinforcementEntry
from palpate.adapters.log.schema import DECISION, EVENT, REINFORCEMENT
from palpate.core.insertion.trial import DecisionRecord, Event, TrialReport, TrialSetup
from tests.unit.adapters.log.recording_bench import Task


def decision(tick: int, reinforcement: float | None = None) -> DecisionRecord:
    return DecisionRecord(tick, "x0", "s0", "+x", "learned", reinforcement)


def entry(tick: int, number: int) -> DecisionEntry:
    return DecisionEntry(tick=tick, number=number, symbol="x0", state="s0", action="+x", source="learned")


def test_everything_is_told_once() -> None:
    task = Task()
    follower = ReportFollower(task)
    task.report.events.append(Event(1, "contact"))
    task.report.decisions.append(decision(2))
    assert follower.news(2) == [(EVENT, EventEntry(tick=1, name="contact")), (DECISION, entry(2, 0))]
    assert follower.news(3) == []
    task.report.decisions[:] = [decision(2, -1.0), decision(16)]
    earned = ReinforcementEntry(tick=16, number=0, reinforcement=-1.0)
    assert follower.news(16) == [(REINFORCEMENT, earned), (DECISION, entry(16, 1))]
    assert follower.news(17) == []


def test_what_the_last_decision_earned_is_told_at_the_end() -> None:
    task = Task()
    follower = ReportFollower(task)
    task.report.decisions.append(decision(2))
    follower.news(2)
    task.report.decisions[0] = decision(2, 0.0)
    assert follower.news(9) == []
    assert follower.news(9, final=True) == [(REINFORCEMENT, ReinforcementEntry(tick=9, number=0, reinforcement=0.0))]


def test_a_decision_that_earned_nothing_is_told_without() -> None:
    task = Task()
    follower = ReportFollower(task)
    task.report.decisions.append(decision(2))
    assert follower.news(9, final=True) == [(DECISION, entry(2, 0))]


def test_a_new_trial_is_followed_from_its_beginning() -> None:
    task = Task()
    task.report.events.append(Event(300, "end"))
    task.report.decisions.append(decision(2, -1.0))
    follower = ReportFollower(task)
    assert follower.news(0, final=True) == []
    task.report = TrialReport(TrialSetup(1, 0, (0.0, 0.0)), events=[Event(0, "lift")])
    assert follower.news(0) == [(EVENT, EventEntry(tick=0, name="lift"))]
