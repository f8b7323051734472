"""Export recorded trials to a LeRobot dataset, and extract examples from such a dataset.

    python -m lerobot_robot_palpate.dataset export runs/paper/logs --out dataset    # or --fps 30
    python -m lerobot_robot_palpate.dataset examples dataset --out examples.csv     # for --learning.examples

Each log becomes an episode without video. Values are not interpolated: a frame contains the latest values at its time
and the age of each sample. ``observation.wrench`` is the raw sensor reading, which includes weight and offset.
``decision.state`` and ``decision.action`` are empty before the first decision and for a step outside the action set.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from lerobot.datasets.lerobot_dataset import LeRobotDataset

from palpate.adapters.log import TrialLog, config_of, find_logs, read_log
from palpate.core.errors import LogError
from palpate.core.ports import CONTROL_RATE_HZ, Validity
from palpate.core.trial import Outcome

_NS: Final = 1_000_000_000
_SAME_NS: Final = 1_000
"""Maximum delay at which a tick still counts as simultaneous with a frame, because both times are rounded."""
_WRENCH: Final = ["force_x_N", "force_y_N", "force_z_N", "torque_x_Nm", "torque_y_Nm", "torque_z_Nm"]
_DTYPES: Final = {"f": "float32", "i": "int64", "b": "bool", "U": "string"}
"""LeRobot data type for each numpy kind."""
_DECISION: Final = ("decision.number", "decision.state", "decision.action")


def frames_of(log: TrialLog, fps: int) -> dict[str, Any]:
    """Return the columns of a trial by name, with one row per frame, from the first tick with complete data.

    A sample that its device marked invalid is replaced by the previous sample, whose age increases. Success is
    determined by the ground truth if it is known, and otherwise by the outcome.

    Raises:
        LogError: No tick has complete data.
    """
    rows = list(_rows(log))
    if not rows:
        raise LogError(log.path, "", "has no tick with samples and a command", "there is nothing to export")
    time_ns = np.array([row["time_ns"] for row in rows])
    count = int(time_ns[-1] - time_ns[0] + _SAME_NS) * fps // _NS + 1
    frame_ns = time_ns[0] + np.arange(count) * _NS // fps
    shown = np.searchsorted(time_ns, frame_ns + _SAME_NS, side="right") - 1
    found = {name: np.array([row[name] for row in rows])[shown] for name in rows[0]}
    tick, last = found["tick"], np.arange(count) == count - 1
    end = log.end
    success = end is not None and (end.outcome == Outcome.INSERTED.value if end.success is None else end.success)
    rewards = np.zeros(count)
    for entry in log.reinforcements:
        # At the last frame before it was earned: nothing is lost, nothing is counted twice.
        rewards[max(int(np.searchsorted(tick, entry.tick)) - 1, 0)] += entry.reinforcement
    newest = np.searchsorted([entry.tick for entry in log.decisions], tick, side="right")
    numbers = np.array([-1, *(entry.number for entry in log.decisions)])
    pairs = [("", "") if entry.index is None else (entry.state, entry.action) for entry in log.decisions]
    examples = np.array([("", ""), *pairs])
    return {
        "observation.state": found["state"],
        "observation.wrench": found["wrench"],
        "observation.state_age_s": (frame_ns - found["state_ns"]) / _NS,
        "observation.wrench_age_s": (frame_ns - found["wrench_ns"]) / _NS,
        "observation.valid": found["valid"],
        "action": found["applied"],
        "action.requested": found["asked"],
        "tick": tick,
        "next.reward": rewards,
        "next.done": last & (end is not None and not end.error),
        "next.success": last & success,
        **dict(zip(_DECISION, (numbers[newest], examples[newest, 0], examples[newest, 1]), strict=True)),
    }


def _rows(log: TrialLog) -> Iterator[dict[str, Any]]:
    """Yield the latest values at each tick."""
    newest: dict[str, Any] = {}
    valid = {"wrench": False, "joints": False}
    for record in log.records():
        if record.wrench is not None:
            valid["wrench"] = record.wrench.validity is Validity.VALID
            if record.wrench.validity is not Validity.INVALID:
                wrench = (*record.wrench.force_N, *record.wrench.torque_Nm)
                newest |= {"wrench": wrench, "wrench_ns": record.wrench.source_time_ns}
        if record.joints is not None:
            valid["joints"] = record.joints.validity is Validity.VALID
            if record.joints.validity is not Validity.INVALID:
                newest |= {"state": record.joints.position_rad, "state_ns": record.joints.source_time_ns}
        if record.requested_rad is not None and record.applied is not None:
            newest |= {"asked": record.requested_rad, "applied": record.applied.position_rad}
        time_ns = record.deadline_ns if record.time_ns is None else record.time_ns
        if time_ns is not None and {"wrench", "state", "asked"} <= newest.keys():
            yield {"time_ns": time_ns, "tick": record.tick, "valid": all(valid.values()), **newest}


def export(paths: Sequence[Path], out: Path, fps: int) -> int:
    """Write logs from a single arm to a new dataset, and return the number of frames.

    Raises:
        LogError: A log cannot be used, or comes from a different arm.
    """
    logs = [read_log(path) for path in paths]
    if len(arms := {log.start.arm for log in logs}) > 1:
        raise LogError(str(out), "", f"would be of several arms, {', '.join(arms)}", "export each arm by itself")
    episodes = [frames_of(log, fps) for log in logs]
    first = episodes[0]
    joints = [f"joint_{i}_rad" for i in range(1, first["observation.state"].shape[1] + 1)]
    names = {"observation.state": joints, "action": joints, "action.requested": joints, "observation.wrench": _WRENCH}
    features = {
        name: {"dtype": _DTYPES[values.dtype.kind], "shape": values.shape[1:] or (1,), "names": names.get(name)}
        for name, values in first.items()
    }
    dataset = LeRobotDataset.create(
        f"palpate/{out.name}", fps, features, root=out, robot_type=logs[0].start.arm, use_videos=False
    )
    for log, episode in zip(logs, episodes, strict=True):
        peg = config_of(log).cell.peg
        task = f"insert the {peg.cross_section} peg of {peg.diameter_mm:g} mm into its hole by touch"
        for number in range(len(episode["tick"])):
            dataset.add_frame({**_frame(episode, number, features), "task": task})
        dataset.save_episode()
    dataset.finalize()
    return sum(len(episode["tick"]) for episode in episodes)


def _frame(episode: dict[str, Any], number: int, features: dict[str, Any]) -> dict[str, Any]:
    values = {name: (column[number], features[name]["dtype"]) for name, column in episode.items()}
    return {
        name: str(value) if dtype == "string" else np.atleast_1d(value).astype(dtype)
        for name, (value, dtype) in values.items()
    }


def examples_in(rows: Sequence[dict[str, Any]]) -> list[tuple[int, int, str, str]]:
    """Return the episode, number, state and action of each decision in successful episodes.

    Args:
        rows: Frames of the dataset, in order.

    Raises:
        ValueError: The frame rate is too low to contain all decisions.
    """
    good = {int(row["episode_index"]) for row in rows if row["next.success"]}
    found: dict[tuple[int, int], tuple[str, str]] = {}
    for row in rows:
        number, state, action = (row[name] for name in _DECISION)
        if (episode := int(row["episode_index"])) in good and number >= 0:
            found[episode, int(number)] = state, action
    for episode in good:
        numbers = [number for one, number in found if one == episode]
        if numbers != list(range(len(numbers))):
            raise ValueError(f"episode {episode} lacks decisions: export it with more frames a second")
    return [(*place, *example) for place, example in found.items() if example[0]]


def main() -> None:
    """Parse the command line, and run the script."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    exporting = commands.add_parser("export", help="export logs to a dataset")
    exporting.add_argument("logs", nargs="+")
    exporting.add_argument("--out", type=Path, required=True, help="folder for the dataset; must not exist")
    exporting.add_argument("--fps", type=int, default=CONTROL_RATE_HZ)
    reading = commands.add_parser("examples", help="write the decisions of successful episodes as CSV")
    reading.add_argument("dataset", type=Path)
    reading.add_argument("--out", type=Path, default=Path("examples.csv"))
    options = parser.parse_args()
    if options.command == "export":
        print(f"{export(find_logs(options.logs), options.out, options.fps)} frames in {options.out}")
        return
    dataset = LeRobotDataset(f"palpate/{options.dataset.name}", root=options.dataset)
    wanted = ["episode_index", *_DECISION, "next.success"]
    rows = dataset.hf_dataset.with_format(None).select_columns(wanted).to_list()
    with options.out.open("x", encoding="utf-8", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows([("trial", "number", "state", "action"), *examples_in(rows)])
    print(f"examples in {options.out}")


if __name__ == "__main__":
    main()
