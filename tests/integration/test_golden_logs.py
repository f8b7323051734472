"""The gate: recorded trials come out of the core again as they were recorded."""

from pathlib import Path

import pytest

from palpate.adapters.replay.batch import explanation, replay_file
from palpate.adapters.replay.engine import Verdict
from palpate.adapters.replay.rebuild import Changes, Rebuilder
from tests.golden.record import NAMES

GOLDEN = Path(__file__).parents[1] / "golden"


@pytest.mark.parametrize("name", NAMES)
def test_golden_log_replays(name: str) -> None:
    one = replay_file(GOLDEN / f"{name}.mcap", Rebuilder())
    told = explanation(one, Changes(), strict=False)
    assert one.verdict in (Verdict.EQUAL, Verdict.NOT_BIT_COMPARABLE), told


def test_there_are_no_others() -> None:
    logs = sorted(GOLDEN.glob("*.mcap"))
    assert sorted(log.stem for log in logs) == sorted(NAMES)


@pytest.mark.parametrize("name", ["first-joint-turned", "first-kind", "trip-invalid"])
def test_one_rebuilder_replays_what_a_latch_ended_and_what_comes_after(name: str) -> None:
    rebuilder = Rebuilder()
    assert [replay_file(GOLDEN / f"{name}.mcap", rebuilder).verdict for _ in range(2)] == [Verdict.EQUAL] * 2
