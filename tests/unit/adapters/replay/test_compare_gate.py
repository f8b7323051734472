"""The gate bites: whatever of a log's outputs is altered by one bit is found, at the right tick and field."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

import pytest

from palpate.adapters.replay.batch import replay_file
from palpate.adapters.replay.engine import Replay, Verdict
from palpate.adapters.replay.rebuild import Rebuilder
from palpate.core.motion.laws import DampingControl
from tests.log_surgery import Change, changed, indices, messages_of, one_ulp, write_log

ReplayChanged: TypeAlias = Callable[[str, int, Change], Replay]


@pytest.fixture
def log(golden_here: Callable[[str], Path]) -> Path:
    return golden_here("train-paper")


@pytest.fixture
def replay_changed(log: Path, tmp_path: Path) -> ReplayChanged:
    """Replays the log after a change to one of its messages."""

    def replay(topic: str, number: int, change: Change) -> Replay:
        messages = messages_of(log)
        index = indices(messages, topic)[number]
        return replay_file(write_log(tmp_path / "changed.mcap", changed(messages, index, change)), Rebuilder())

    return replay


def test_surgery_alone_changes_nothing(log: Path, tmp_path: Path) -> None:
    one = replay_file(write_log(tmp_path / "same.mcap", messages_of(log)), Rebuilder())
    assert one.verdict is Verdict.EQUAL


@pytest.mark.parametrize("tick", [0, 1, 100, 270])
@pytest.mark.parametrize("joint", [0, 2, 5])
@pytest.mark.parametrize("field", ["asked_rad", "applied_rad"])
def test_a_command_changed_by_one_bit(replay_changed: ReplayChanged, tick: int, joint: int, field: str) -> None:
    one = replay_changed("/tick", tick, one_ulp(field, joint))
    assert one.verdict is Verdict.DIVERGED
    assert one.first is not None
    assert (one.first.tick, one.first.channel) == (tick, "/tick")
    # One and the same number: as asked, it contradicts the core; as applied, it contradicts what was asked.
    assert one.first.field == f"{field}[{joint}]"


@pytest.mark.parametrize("topic", ["/decision", "/event", "/reinforcement"])
@pytest.mark.parametrize("number", [0, 1, -1])
def test_a_message_that_is_missing(log: Path, tmp_path: Path, topic: str, number: int) -> None:
    messages = messages_of(log)
    del messages[indices(messages, topic)[number]]
    one = replay_file(write_log(tmp_path / "short.mcap", messages), Rebuilder())
    assert one.verdict is Verdict.DIVERGED
    assert one.first is not None
    assert one.first.channel == topic


def test_a_gain_in_the_core_that_is_other_by_one_part_in_a_million_million(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    law = DampingControl.__init__

    def changed_gain(self: DampingControl, damping: float, *others: object) -> None:
        law(self, damping * (1.0 + 1e-12), *others)  # type: ignore[arg-type]

    monkeypatch.setattr(DampingControl, "__init__", changed_gain)
    one = replay_file(log, Rebuilder())
    assert one.verdict is Verdict.DIVERGED
    assert one.first is not None
    assert one.first.field.startswith("asked_rad")
