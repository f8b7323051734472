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


def test_there_are_no_others_and_they_are_small() -> None:
    logs = sorted(GOLDEN.glob("*.mcap"))
    assert sorted(log.stem for log in logs) == sorted(NAMES)
    # One of them alone, of the ten seconds after which a peg counts as jammed, has 230 kB. What a policy learns from
    # several trials, and how it searches when it is wrong take longer logs than a fault does; an
    # automaton, an option and a search in even steps need one each, of 50 kB. A tool that lags, one that leans too far
    # and one that stands still from its first push came to 27 kB each; two seconds of waiting for an answer to 28; and
    # five of 18 to 50 kB show what none had: a force that comes sooner, a turned hole, slow and uneven heaves, pulls;
    # six of 12 to 60 kB a triangle's walls, a flat met aside, a belief in double precision,
    # another tool axis.
    # A false drop before the plate was touched, half a second of waiting, 35.
    assert sum(log.stat().st_size for log in logs) < 9_090_000


@pytest.mark.parametrize("name", ["first-joint-turned", "first-kind", "trip-invalid"])
def test_one_rebuilder_replays_what_a_latch_ended_and_what_comes_after(name: str) -> None:
    rebuilder = Rebuilder()
    assert [replay_file(GOLDEN / f"{name}.mcap", rebuilder).verdict for _ in range(2)] == [Verdict.EQUAL] * 2
