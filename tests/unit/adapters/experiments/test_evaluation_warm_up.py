"""The trial before the first."""

from palpate.adapters.config.run import RunConfig
from palpate.adapters.experiments.evaluation import warm_up
from palpate.core.trial.report import Outcome
from tests.unit.adapters.samples import ready_pose


def test_a_warm_up_goes_through_every_phase() -> None:
    report = warm_up(RunConfig(), ready_pose())
    assert report.outcome is Outcome.INSERTED
    assert {event.detail for event in report.events if event.name == "phase"} >= {"transfer", "explore", "insert"}
