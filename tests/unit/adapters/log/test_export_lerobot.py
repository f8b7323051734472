"""Logs as a LeRobot dataset: frames of a fixed rate that hold what was newest, and say how old it was."""

import json
import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from palpate.adapters.config import scenario, to_toml
from palpate.adapters.log import EndRecord, ReinforcementEntry, TickRecord, export_lerobot, read_log
from palpate.adapters.log.export_lerobot import frames_of
from palpate.core.errors import ConfigurationError, LogError
from palpate.core.ports.values import AppliedCommand, CommandReason, JointSample, Validity, WrenchSample
from tests.unit.adapters.log.made_logs import PERIOD_NS, POSTURE, start, tick, write_log

NS = 1_000_000_000
MS = 1_000_000


def exact(number: int, **changes: Any) -> TickRecord:
    """A tick at the very time of the control rate, as the loop counts it."""
    now = 123 + number * NS // 140
    wrench = WrenchSample((0.1 * number, -1.0, 3.0), (0.01, 0.02, 0.03), now - 2 * MS, now, number)
    joints = JointSample(tuple(q + 1e-4 * number for q in POSTURE), now, now, number)
    return tick(number, time_ns=now, deadline_ns=now, wrench=wrench, joints=joints, **changes)


def frames(path: Path, ticks: list[TickRecord], fps: int, **more: Any) -> dict[str, Any]:
    return frames_of(read_log(write_log(path / "a.mcap", ticks, **more)), fps)


def column(folder: Path, name: str) -> np.ndarray:
    return np.array(pq.read_table(folder / "data/chunk-000/file-000.parquet")[name].to_pylist())


def test_rounded_clock_readings_do_not_make_frames_miss_their_tick(tmp_path: Path) -> None:
    late_by_one = [exact(k, counterfactual=False) for k in range(500)]
    late_by_one = [replace(r, time_ns=(r.time_ns or 0) + r.tick % 2) for r in late_by_one]
    assert frames(tmp_path, late_by_one, 140)["tick"].tolist() == list(range(500))


def test_fewer_frames_take_the_newest_tick_and_interpolate_nothing(tmp_path: Path) -> None:
    found = frames(tmp_path, [exact(k) for k in range(141)], 30)
    assert len(found["tick"]) == 31
    # Frame k is at k/30 s: the last tick that had begun by then.
    assert found["tick"].tolist() == [k * 140 // 30 for k in range(31)]
    assert found["observation.wrench"][:, 0] == pytest.approx(0.1 * found["tick"])
    for k in range(31):
        expected = k / 30 - (k * 140 // 30) / 140
        assert found["observation.state_age_s"][k] == pytest.approx(expected, abs=1e-8)
        assert found["observation.wrench_age_s"][k] == pytest.approx(expected + 0.002, abs=1e-8)


def test_more_frames_than_ticks_show_ticks_again_and_older(tmp_path: Path) -> None:
    found = frames(tmp_path, [exact(k) for k in range(8)], 280)
    assert found["tick"].tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7]
    assert found["observation.state_age_s"][1] == pytest.approx(1 / 280, abs=1e-8)


def test_a_gap_is_seen_by_the_age(tmp_path: Path) -> None:
    found = frames(tmp_path, [exact(k) for k in (0, 1, 2, 8, 9)], 140)
    assert found["tick"].tolist() == [0, 1, 2, 2, 2, 2, 2, 2, 8, 9]
    assert found["observation.state_age_s"][7] == pytest.approx(5 / 140, abs=1e-8)


def test_an_invalid_sample_leaves_the_one_before(tmp_path: Path) -> None:
    bad = WrenchSample((math.nan,) * 3, (0.0,) * 3, 5, 5, 9, Validity.INVALID)  # type: ignore[arg-type]
    saturated = replace(exact(3).wrench, validity=Validity.SATURATED)  # type: ignore[type-var]
    ticks = [exact(0), exact(1), replace(exact(2), wrench=bad), replace(exact(3), wrench=saturated), exact(4)]
    found = frames(tmp_path, ticks, 140)
    assert found["observation.wrench"][:, 0] == pytest.approx([0.0, 0.1, 0.1, 0.3, 0.4])
    assert found["observation.wrench_age_s"][2] == pytest.approx(0.002 + 1 / 140, abs=1e-8)
    assert found["observation.valid"].tolist() == [True, True, False, False, True]


def test_frames_begin_where_everything_is_there(tmp_path: Path) -> None:
    silent = {"applied": None, "asked_rad": None}
    ticks = [replace(exact(0), wrench=None, **silent), replace(exact(1), **silent), exact(2), exact(3)]
    found = frames(tmp_path, ticks, 140)
    assert found["tick"].tolist() == [2, 3]
    with pytest.raises(LogError, match="nothing to export"):
        frames_of(read_log(write_log(tmp_path / "b.mcap", ticks[:1])), 140)


@pytest.mark.parametrize("fps", [7, 30, 140, 400])
def test_rewards_are_neither_lost_nor_counted_twice(tmp_path: Path, fps: int) -> None:
    earned = [ReinforcementEntry(tick=k, number=k, reinforcement=-1.0 - k) for k in (0, 1, 14, 28, 28, 59)]
    found = frames(tmp_path, [exact(k) for k in range(60)], fps, others=earned)
    assert found["next.reward"].sum() == sum(entry.reinforcement for entry in earned)
    # A reward follows the frame that came before it.
    (frame,) = np.flatnonzero(found["next.reward"] == -15.0) if fps >= 30 else (0,)
    assert found["tick"][frame] < 14


@pytest.mark.parametrize(
    ("end", "success", "ended"),
    [
        (None, False, False),
        (EndRecord(tick=1, outcome="inserted", success=True), True, True),
        (EndRecord(tick=1, outcome="inserted", success=False), False, True),
        (EndRecord(tick=1, outcome="inserted"), True, True),
        (EndRecord(tick=1, outcome="jammed"), False, True),
        (EndRecord(tick=1, error="DeviceError"), False, False),
    ],
)
def test_success_by_truth_or_else_by_outcome(tmp_path: Path, end: EndRecord | None, success: bool, ended: bool) -> None:
    found = frames(tmp_path, [exact(0), exact(1)], 140, end=end)
    assert (found["next.success"].tolist(), found["next.done"].tolist()) == ([False, success], [False, ended])


def test_the_dataset(tmp_path: Path) -> None:
    end = EndRecord(tick=49, outcome="inserted", success=True)
    limited = AppliedCommand((0.5,) * 6, CommandReason.VELOCITY_LIMIT)
    paths = [
        write_log(tmp_path / "a.mcap", [exact(0, applied=limited), *(exact(k) for k in range(1, 50))], end=end),
        write_log(tmp_path / "b.mcap", [exact(k) for k in range(20)]),
    ]
    out = tmp_path / "out"
    assert export_lerobot(paths, out, 140) == 70
    info = json.loads((out / "meta/info.json").read_text())
    assert (info["codebase_version"], info["fps"], info["robot_type"]) == ("v3.0", 140, "zebra-zero")
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (2, 70, 1)
    table = pq.read_table(out / info["data_path"].format(chunk_index=0, file_index=0))
    assert set(table.column_names) == set(info["features"])
    for name, feature in info["features"].items():
        kind = table.schema.field(name).type
        assert (str(kind) if feature["shape"] == [1] else (str(kind.value_type), kind.list_size)) in (
            {"float32": "float", "int64": "int64", "bool": "bool", "string": "string"}[feature["dtype"]],
            ("float", feature["shape"][0]),
        )
        assert feature["names"] is None or len(feature["names"]) == feature["shape"][0]
    assert column(out, "index").tolist() == list(range(70))
    assert column(out, "episode_index").tolist() == [0] * 50 + [1] * 20
    assert column(out, "frame_index").tolist() == [*range(50), *range(20)]
    assert column(out, "timestamp")[:50] == pytest.approx(np.arange(50) / 140, abs=1e-6)
    assert np.flatnonzero(column(out, "next.done")).tolist() == [49]
    assert np.flatnonzero(column(out, "next.success")).tolist() == [49]
    assert column(out, "action")[:2] == pytest.approx(np.array([[0.5] * 6, POSTURE]), abs=1e-6)
    assert column(out, "action.asked")[:2] == pytest.approx(np.array([POSTURE, POSTURE]), abs=1e-6)
    assert column(out, "observation.state")[3] == pytest.approx([q + 3e-4 for q in POSTURE], abs=1e-6)
    assert column(out, "observation.wrench")[53] == pytest.approx([0.3, -1.0, 3.0, 0.01, 0.02, 0.03], abs=1e-6)
    assert column(out, "observation.wrench_age_s") == pytest.approx(0.002, abs=1e-6)


def test_what_describes_the_episodes(tmp_path: Path) -> None:
    paths = [write_log(tmp_path / f"{n}.mcap", [exact(k) for k in range(n)]) for n in (50, 20)]
    out = tmp_path / "out"
    export_lerobot(paths, out, 140)
    first, second = pq.read_table(out / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert (first["dataset_from_index"], first["dataset_to_index"], first["length"]) == (0, 50, 50)
    assert (second["episode_index"], second["dataset_from_index"], second["dataset_to_index"]) == (1, 50, 70)
    assert second["tasks"] == ["insert the round peg of 29 mm into its hole by touch"]
    wrench = column(out, "observation.wrench")
    assert second["stats/observation.wrench/max"] == pytest.approx(wrench[50:].max(axis=0).tolist())
    assert second["stats/observation.wrench/count"] == [20]
    stats = json.loads((out / "meta/stats.json").read_text())["observation.wrench"]
    assert stats["mean"] == pytest.approx(wrench.mean(axis=0).tolist(), abs=1e-6)
    assert stats["std"] == pytest.approx(wrench.std(axis=0).tolist(), abs=1e-6)
    assert stats["q50"] == pytest.approx(np.median(wrench, axis=0).tolist(), abs=1e-6)
    assert stats["count"] == [70]
    tasks = pq.read_table(out / "meta/tasks.parquet")
    assert json.loads(tasks.schema.metadata[b"pandas"])["index_columns"] == ["__index_level_0__"]
    assert tasks["__index_level_0__"].to_pylist() == second["tasks"]
    assert tasks["task_index"].to_pylist() == [0]


def test_pegs_of_other_sizes_are_other_tasks(tmp_path: Path) -> None:
    small = start(config_toml=to_toml(scenario("paper")).replace("diameter_mm = 29.0", "diameter_mm = 8.0"))
    paths = [
        write_log(tmp_path / "a.mcap", [exact(0), exact(1)]),
        write_log(tmp_path / "b.mcap", [exact(0), exact(1)], begin=small),
    ]
    out = tmp_path / "out"
    export_lerobot(paths, out, 140)
    tasks = pq.read_table(out / "meta/tasks.parquet")["__index_level_0__"].to_pylist()
    assert [tasks[i] for i in column(out, "task_index")] == [
        *["insert the round peg of 29 mm into its hole by touch"] * 2,
        *["insert the round peg of 8 mm into its hole by touch"] * 2,
    ]


def test_the_achieved_rates_and_ages_are_told(tmp_path: Path) -> None:
    def slow(k: int) -> TickRecord:
        # A loop that was asked for 140 Hz and ran at 70, over a sensor that gave every value twice.
        now, old = 2 * k * PERIOD_NS, k // 2 * 2
        wrench = WrenchSample((0.0,) * 3, (0.0,) * 3, 2 * old * PERIOD_NS - 4 * MS, now, old)  # type: ignore[arg-type]
        return tick(k, time_ns=now, deadline_ns=now, wrench=wrench)

    out = tmp_path / "out"
    export_lerobot([write_log(tmp_path / "a.mcap", [slow(k) for k in range(100)])], out, 140)
    told = json.loads((out / "meta/info.json").read_text())["palpate"]
    assert told["achieved_control_rate_Hz"]["median"] == pytest.approx(70.0, abs=0.01)
    assert told["achieved_wrench_rate_Hz"]["median"] == pytest.approx(35.0, abs=0.01)
    assert told["wrench_age_s"]["max"] == pytest.approx(0.004 + 3 * PERIOD_NS * 1e-9, abs=1e-6)
    (episode,) = json.loads((out / "meta/palpate.json").read_text())["episodes"]
    assert episode["frames_showing_an_older_tick"] == 99
    assert episode["success_by"] == "outcome of the core"
    assert episode["wrench_tare_from"].startswith("nothing")


def test_another_arm_is_refused_and_nothing_written(tmp_path: Path) -> None:
    paths = [
        write_log(tmp_path / "a.mcap", [exact(0)]),
        write_log(tmp_path / "b.mcap", [exact(0)], begin=start(arm="ur5")),
    ]
    with pytest.raises(LogError, match="of the arm ur5, others before it of zebra-zero"):
        export_lerobot(paths, tmp_path / "out", 140)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.mcap", "b.mcap"]


def test_without_pyarrow_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    monkeypatch.delitem(sys.modules, "pyarrow.parquet", raising=False)
    with pytest.raises(ConfigurationError, match=r"pip install 'palpate\[lerobot\]'"):
        export_lerobot([write_log(tmp_path / "a.mcap", [exact(0)])], tmp_path / "out", 140)
    assert not (tmp_path / "out").exists()
