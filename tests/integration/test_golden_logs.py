"""The regression gate: the core gives every recorded trial again, and each shows what its recipe claims."""

from pathlib import Path

import pytest

from palpate.adapters.log import read_log
from palpate.adapters.replay.batch import explanation, replay_file
from palpate.adapters.replay.engine import Verdict
from palpate.adapters.replay.rebuild import Changes, Rebuilder
from palpate.core.trial import Outcome, TripReason
from tests.golden.record import CLAIMS, NAMES, shown

GOLDEN = Path(__file__).parents[1] / "golden"
ELSEWHERE = {Outcome.DONE, Outcome.OUT_OF_TOLERANCE, Outcome.NO_CONTACT, Outcome.CONTACT_MISMATCH}
"""Outcomes of other tasks than an insertion, or without a supervisor."""


@pytest.mark.parametrize("name", NAMES)
def test_golden_log_replays(name):
    one = replay_file(GOLDEN / f"{name}.mcap", Rebuilder())
    message = explanation(one, Changes(), strict=False)
    assert one.verdict in (Verdict.EQUAL, Verdict.NOT_BIT_COMPARABLE), message


def test_there_are_no_others():
    assert sorted(log.stem for log in GOLDEN.glob("*.mcap")) == sorted(NAMES)


def test_golden_logs_show_what_their_recipes_claim():
    assert {name: shown(read_log(GOLDEN / f"{name}.mcap")) for name in CLAIMS} == CLAIMS


def test_golden_logs_show_every_outcome_and_trip_reason():
    claimed = {word for claim in CLAIMS.values() for word in claim.split(", ")}
    assert {one.value for one in set(Outcome) - ELSEWHERE} <= claimed
    assert {reason.name for reason in TripReason} <= claimed


@pytest.mark.parametrize("name", ["first-joints-invalid", "first-kind", "trip-invalid"])
def test_one_rebuilder_replays_what_a_latch_ended_and_what_comes_after(name):
    rebuilder = Rebuilder()
    assert [replay_file(GOLDEN / f"{name}.mcap", rebuilder).verdict for _ in range(2)] == [Verdict.EQUAL] * 2
