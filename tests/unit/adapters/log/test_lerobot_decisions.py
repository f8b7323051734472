import json
from pathlib import Path

import pytest

from palpate.adapters.config import RunConfig
from palpate.adapters.experiments import build_perception
from palpate.adapters.log import DecisionEntry, EndRecord, export_lerobot, import_examples
from palpate.core.errors import LogError
from palpate.core.perception import perception_to_dict
from palpate.core.policy import PERSON
from tests.unit.adapters.log.made_logs import start, write_log
from tests.unit.adapters.log.test_export_lerobot import column, exact

PERCEPTION = build_perception(RunConfig())
STATES = PERCEPTION.states


def chosen(number: int, state: int, action: str, index: int | None, *grounds: float, source: str = "") -> DecisionEntry:
    name = STATES[state]
    return DecisionEntry(
        tick=14 * (number + 1), number=number, symbol=name, state=name, action=action, source=source, index=index,
        grounds=grounds,
    )  # fmt: skip


LEARNED = [chosen(0, 0, "-x", 4), chosen(1, 0, "rest", None), chosen(2, 3, "+y", 2), chosen(3, 0, "+x", 0)]
SHOWN = [
    chosen(0, 5, "rest", None, source=PERSON),
    # Felt before the hand came, and a step of the same push.
    chosen(1, 6, "+y", 2, 0.25, 5.0, source=PERSON),
    chosen(2, 7, "+y", 2, 0.25, -1.0, source=PERSON),
]


def dataset(folder: Path, fps: int) -> Path:
    begin = start(perception_json=json.dumps(perception_to_dict(PERCEPTION)))
    good, bad = EndRecord(tick=69, outcome="inserted"), EndRecord(tick=69, outcome="time limit")
    paths = [
        write_log(folder / f"{name}.mcap", [exact(k) for k in range(70)], others=others, end=end, begin=begin)
        for name, others, end in (("a", LEARNED, good), ("b", LEARNED, bad), ("c", SHOWN, good), ("d", [], good))
    ]
    export_lerobot(paths, folder / "out", fps)
    return folder / "out"


@pytest.mark.parametrize("fps", [10, 140, 300])
def test_examples_come_back_from_episodes_that_succeeded(tmp_path: Path, fps: int) -> None:
    assert import_examples(dataset(tmp_path, fps)) == [
        (0, 0, STATES[0], "-x"), (0, 2, STATES[3], "+y"), (0, 3, STATES[0], "+x"), (2, 1, STATES[5], "+y"),
    ]  # fmt: skip


def test_a_frame_has_the_newest_decision(tmp_path: Path) -> None:
    out = dataset(tmp_path, 140)
    assert column(out, "decision.number")[:70].tolist() == [*[-1] * 14, *[0] * 14, *[1] * 14, *[2] * 14, *[3] * 14]
    assert [column(out, f"decision.{name}")[14] for name in ("state", "action")] == [STATES[0], "-x"]
    assert column(out, "decision.state")[[0, 28]].tolist() == ["", ""]


def test_what_holds_no_whole_decisions_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="more frames a second"):
        import_examples(dataset(tmp_path, 3))
    with pytest.raises(LogError, match="no LeRobot dataset with decisions"):
        import_examples(tmp_path / "nowhere")
