"""The ``palpate log`` command, which shows recorded trials and converts them to other formats."""

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from palpate.core.errors import LogError, UsageError, one_line
from palpate.core.ports import OneOf, Settings

if TYPE_CHECKING:
    from palpate.adapters.log import TrialLog


Files = Annotated[tuple[str, ...], tyro.conf.Positional]


@dataclass(frozen=True)
class InfoOptions(Settings):
    """Summarise logs: configuration, timing, completeness and outcome."""

    files: Files = ()
    """Logs, or folders that contain logs. One log is shown as a page, several as a table."""
    json: bool = False
    """Print all details of every log as a JSON list."""


@dataclass(frozen=True)
class PlotOptions(Settings):
    """Plot a trial over time: forces, torques, position, states, actions and events."""

    file: Annotated[str, tyro.conf.Positional]
    """Log to plot."""
    out: str = ""
    """New .png, .svg or .pdf file for the figure. Default: NAME.png next to the log."""


@dataclass(frozen=True)
class ScoreOptions(Settings):
    """Score trials with up to 100 points, according to the score sheet of the AI for Industry Challenge (March 2026).

    An insertion gives 75 points, a partial insertion 38 to 50, and a position near the hole up to 25. Low jerk gives up
    to 6 points, a short time up to 12 (within 5 s), and a short path up to 6. More than 1 s above 20 N costs 12 points.
    Contact with forbidden objects is not detected.
    """

    files: Files = ()
    """Logs, or folders that contain logs."""
    json: bool = False
    """Print points, jerk, path and times as a JSON list."""


@dataclass(frozen=True)
class ExportOptions(Settings):
    """Export logs as lossless CSV or as ROS 2 bags. Rerun and Foxglove open logs directly."""

    files: Files = ()
    """Logs, or folders that contain logs."""
    to: Annotated[str, OneOf("csv", "rosbag2")] = "csv"
    """Output format."""
    out: str = ""
    """New or empty folder for the exported files."""


@dataclass(frozen=True)
class ImportOptions(Settings):
    """Convert JointState and WrenchStamped messages in a ROS 2 bag (MCAP or SQLite) to a log at the control rate."""

    bag: Annotated[str, tyro.conf.Positional]
    """Bag folder."""
    job: str = ""
    """Job file: part, tool, arm and place. Default: the paper's peg."""
    arm: str = ""
    """Name of the arm. Default: the arm in the job."""
    joints: tuple[str, ...] = ()
    """Names of the joints in the messages, base first. Default: the names in the model."""
    joint_states: str = ""
    """Topic with the joint angles. Default: the only topic of its type."""
    wrench: str = ""
    """Topic with the wrenches. Default: the only topic of its type."""
    reverse_wrench: bool = False
    """Reverse the signs, if the bag contains the wrench that the tool exerts on its surroundings."""
    out: str = ""
    """New file for the log. Default: NAME.mcap in the current folder."""


def info(options: InfoOptions) -> int:
    """Print the contents of logs; return 0, or 2 if a log is damaged or unusable."""
    files = _logs(options.files, "info")
    from palpate.adapters.log import describe, finite, info_of, read_log, table

    infos = []
    for name in files:
        try:
            infos.append(info_of(read_log(name)))
        except LogError as error:
            # One bad log must not hide the others.
            sys.stderr.write(f"palpate: {one_line(error)}\n")
    if options.json:
        shown = finite(infos)
        sys.stdout.write(json.dumps(shown, indent=2, ensure_ascii=False, allow_nan=False) + "\n")
    elif len(files) == 1:
        sys.stdout.write("".join(describe(info) for info in infos))
    elif infos:
        sys.stdout.write(table(infos))
    return 0 if sum(not info["damage"] for info in infos) == len(files) else 2


def plot(options: PlotOptions) -> int:
    """Plot a trial over time, and return the exit code."""
    from palpate.adapters.files import new_file, require_no_file
    from palpate.adapters.log import figure_kind, read_log, timeline

    trial = read_log(options.file)
    print_damage(trial)
    out = Path(options.out or Path(options.file).with_suffix(".png"))
    kind = figure_kind(out, "--out")
    require_no_file(out)
    picture = timeline(trial, kind)
    with new_file(out) as passing:
        passing.write_bytes(picture)
    sys.stdout.write(f"drawn in {out}\n")
    return 0


def score(options: ScoreOptions) -> int:
    """Print the scores of trials, and return the exit code."""
    files = _logs(options.files, "score")
    from palpate.adapters.log import read_log, score_of, score_table

    scored = [score_of(read_log(name)) for name in files]
    if options.json:
        shown = [{**asdict(trial), "total": trial.score.total} for trial in scored]
        sys.stdout.write(json.dumps(shown, indent=2) + "\n")
    else:
        sys.stdout.write(score_table(scored))
    return 0


def export(options: ExportOptions) -> int:
    """Write trials in another format, and return the exit code."""
    paths = _logs(options.files, "export")
    options.require("out", bool(options.out), "a folder for the result")
    out = Path(options.out)
    from palpate.adapters.log import export_bags, export_csv, read_log

    for path in paths:
        print_damage(read_log(path))
    write, kind = (export_csv, "CSV") if options.to == "csv" else (export_bags, "bags")
    folders = write(paths, out)
    sys.stdout.write(f"{len(folders)} trial{'s' * (len(folders) > 1)} as {kind} in {out}\n")
    return 0


def import_(options: ImportOptions) -> int:
    """Convert a bag to a log, and return the exit code."""
    from palpate.adapters.config import configured
    from palpate.adapters.experiments import plain_perception, ready_pose
    from palpate.adapters.files import new_file, require_no_file
    from palpate.adapters.log import BagTopics, log_of_bag

    bag, out = Path(options.bag), Path(options.out or f"{Path(options.bag).stem}.mcap")
    require_no_file(out)
    config = configured(options.job or None, arm=options.arm)
    sign = -1 if options.reverse_wrench else 1
    topics = BagTopics(options.joint_states, options.wrench, options.joints, sign)
    data = log_of_bag(bag, config, ready_pose(config), plain_perception(config), topics)
    with new_file(out) as passing:
        passing.write_bytes(data)
    sys.stdout.write(f"{out}: {bag} as a log of {config.arm}\n")
    return 0


def print_damage(log: "TrialLog") -> None:
    """Print any damage to a log that is still usable."""
    if log.damage or log.missing:
        sys.stderr.write(f"palpate: {log.path}: {log.damage or log.missing}\n")


def _logs(names: Sequence[str], command: str) -> list[Path]:
    """Return the named logs, including those in folders and subfolders."""
    if not names:
        raise UsageError(f"palpate log {command} needs a log; name one or more .mcap files, or folders of them")
    from palpate.adapters.log import find_logs

    return find_logs(names)
