"""Proof that LeRobot loads what ``palpate log export --to lerobot`` writes, with the values of the logs.

LeRobot has dependencies of its own, so it gets an environment of its own; palpate is not needed in it. The values are
compared with the CSV export of the same logs, which holds every bit of them:

    palpate log export runs/paper/logs/trial-0000?.mcap --to lerobot --out /tmp/dataset
    palpate log export runs/paper/logs/trial-0000?.mcap --to csv --out /tmp/csv
    python3 -m venv /tmp/lerobot && /tmp/lerobot/bin/pip install lerobot
    HF_HUB_OFFLINE=1 /tmp/lerobot/bin/python benchmarks/lerobot_reload.py /tmp/dataset /tmp/csv
"""

from __future__ import annotations

import argparse
import csv
import json
from importlib.metadata import version
from pathlib import Path

import numpy as np
import torch
from lerobot.datasets.lerobot_dataset import LeRobotDataset

COLUMNS = {
    "observation.state": "joint_{}_rad",
    "action": "applied_{}_rad",
    "action.asked": "asked_{}_rad",
}
WRENCH = ("force_x_N", "force_y_N", "force_z_N", "torque_x_Nm", "torque_y_Nm", "torque_z_Nm")
AGES = {"observation.wrench_age_s": "wrench_source_time_ns", "observation.state_age_s": "joints_source_time_ns"}


def ticks_of(folder: Path) -> dict[int, dict[str, str]]:
    with (folder / "ticks.csv").open(newline="", encoding="utf-8") as file:
        return {int(row["tick"]): row for row in csv.DictReader(file)}


def check(name: str, found: torch.Tensor, expected: list[float], where: str) -> None:
    if not np.array_equal(found.numpy().ravel(), np.array(expected, dtype=np.float32)):
        raise SystemExit(f"{where}: {name} is {found.tolist()}, the log has {expected}")


def compare(dataset: LeRobotDataset, folder: Path, episode: int, begin: int, end: int) -> int:
    """Compare every frame of an episode; returns how many numbers were compared."""
    ticks = ticks_of(folder)
    first_ns = int(next(iter(ticks.values()))["time_ns"])
    compared = 0
    for frame, index in enumerate(range(begin, end)):
        item, where = dataset[index], f"episode {episode}, frame {frame}"
        row = ticks[int(item["tick"])]
        if (int(item["episode_index"]), int(item["frame_index"])) != (episode, frame):
            raise SystemExit(f"{where} says that it is frame {item['frame_index']} of episode {item['episode_index']}")
        frame_ns = first_ns + frame * 1_000_000_000 // dataset.fps
        if int(row["time_ns"]) > frame_ns + 1000:
            raise SystemExit(f"{where}: tick {row['tick']} came only after the frame")
        after = ticks.get(int(row["tick"]) + 1)
        if after is not None and int(after["time_ns"]) <= frame_ns:
            raise SystemExit(f"{where}: tick {row['tick']} is not the newest")
        expected = {name: [float(row[c.format(i)]) for i in range(1, 7)] for name, c in COLUMNS.items()}
        expected["observation.wrench"] = [float(row[c]) for c in WRENCH]
        expected |= {name: [(frame_ns - int(row[column])) / 1e9] for name, column in AGES.items()}
        for name, values in expected.items():
            check(name, item[name], values, where)
            compared += len(values)
    return compared


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("csv", type=Path)
    options = parser.parse_args()
    dataset = LeRobotDataset("palpate/export", root=options.dataset)
    facts = json.loads((options.dataset / "meta/palpate.json").read_text(encoding="utf-8"))["episodes"]
    compared = 0
    for number, fact in enumerate(facts):
        described = dataset.meta.episodes[number]
        begin, end = described["dataset_from_index"], described["dataset_to_index"]
        folder = options.csv if len(facts) == 1 else options.csv / Path(fact["log"]).stem
        compared += compare(dataset, folder, number, begin, end)
    ahead = LeRobotDataset(
        "palpate/export", root=options.dataset, delta_timestamps={"action": [k / dataset.fps for k in range(4)]}
    )
    batch = next(iter(torch.utils.data.DataLoader(ahead, batch_size=8, shuffle=True)))
    print(f"lerobot {version('lerobot')}, torch {torch.__version__}, datasets {version('datasets')}")
    print(f"{dataset.num_episodes} episodes, {dataset.num_frames} frames at {dataset.fps} Hz")
    print(f"tasks: {list(dataset.meta.tasks.index)}")
    print(f"{compared} numbers compared with the logs, all equal as float32")
    print(f"a batch with four actions ahead: {tuple(batch['action'].shape)}")


if __name__ == "__main__":
    main()
