"""``palpate replay FOLDER``: whatever is missing, cut, altered or foreign in a run folder is found."""

import json
import shutil
import signal
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

import pytest

from palpate.adapters.experiments import trial
from palpate.adapters.experiments.manifest import Print
from palpate.adapters.replay import batch
from palpate.adapters.replay.batch import Replay, replay_file
from palpate.adapters.replay.rebuild import Rebuilder
from palpate.core.policy import Decision
from palpate.core.tasks.insertion import Agent
from tests.command_line import CommandLine, shared_folder
from tests.log_surgery import Change, changed, in_start, indices, messages_of, one_ulp, write_log

Tampering: TypeAlias = Callable[[Path], None]
GOLDEN = Path(__file__).parents[1] / "golden"


@pytest.fixture(scope="session")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three trials as short as trials with some decisions can be: every test here replays them all."""

    def make(out: Path) -> None:
        CommandLine().succeed("train", "--task.time-limit-s", 0.5, "--trials", 3, "--out", out)

    return shared_folder(tmp_path_factory, "briefly", make)


def gone(name: str) -> Tampering:
    return lambda folder: (folder / name).unlink()


def cut(name: str, share: float = 0.5) -> Tampering:
    return lambda folder: _write(folder / name, lambda data: data[: int(len(data) * share)])


def swapped(name: str, old: str, new: str) -> Tampering:
    def swap(data: bytes) -> bytes:
        assert old.encode() in data
        return data.replace(old.encode(), new.encode(), 1)

    return lambda folder: _write(folder / name, swap)


def _write(path: Path, change: Callable[[bytes], bytes]) -> None:
    path.write_bytes(change(path.read_bytes()))


def log_with(topic: str, number: int, change: Change, name: str = "trial-00001.mcap") -> Tampering:
    """One message of a log is changed, and its checksums are made good."""

    def tamper(folder: Path) -> None:
        path = folder / "logs" / name
        messages = messages_of(path)
        path.unlink()
        write_log(path, changed(messages, indices(messages, topic)[number], change))

    return tamper


def _in_json(name: str, change: Callable[[Any], None]) -> Tampering:
    def tamper(folder: Path) -> None:
        content = json.loads((folder / name).read_text())
        change(content)
        (folder / name).write_text(json.dumps(content))

    return tamper


def _set(**fields: Any) -> Change:
    return lambda made: [setattr(made, name, value) for name, value in fields.items()] and None


def _one_visit_more(checkpoint: Any) -> None:
    checkpoint["learner"]["visits"][0][0] += 1


def _two_logs_change_places(folder: Path) -> None:
    first, second, aside = (folder / "logs" / name for name in ("trial-00000.mcap", "trial-00001.mcap", "x"))
    first.rename(aside)
    second.rename(first)
    aside.rename(second)


def _a_trial_more_and_the_manifest_made_good(folder: Path) -> None:
    def add(data: bytes) -> bytes:
        _, _, rest = data.splitlines(True)[-1].partition(b",")
        return data + b"3," + rest

    _write(folder / "trials.csv", add)
    _made_good(folder)


def _no_manifest_and_no_settings(folder: Path) -> None:
    for name in ("manifest.json", "run.toml"):
        gone(name)(folder)


def _first_log_and_its_line_gone(folder: Path) -> None:
    gone("logs/trial-00000.mcap")(folder)
    for name in ("trials.csv", "decisions.csv"):
        _write(folder / name, lambda data: b"".join(x for x in data.splitlines(True) if not x.startswith(b"0,")))


def _last_trial_gone(folder: Path) -> None:
    for name in ("logs/trial-00002.mcap", "policy.json", "checkpoint.json", "summary.json"):
        gone(name)(folder)
    for name in ("trials.csv", "decisions.csv"):
        _write(folder / name, lambda data: b"".join(x for x in data.splitlines(True) if not x.startswith(b"2,")))


def _lines_change_places(folder: Path) -> None:
    def change(data: bytes) -> bytes:
        head, first, second, third = data.splitlines(True)
        return head + second + first + third

    _write(folder / "trials.csv", change)


MADE_GOOD: dict[str, Tampering] = {
    **{f"{name} gone": gone(name) for name in ("policy.json", "checkpoint.json", "run.toml", "summary.json")},
    "decisions gone": gone("decisions.csv"),
    "first log and its line gone": _first_log_and_its_line_gone,
    "last trial and what is left of it gone": _last_trial_gone,
    "lines in another order": _lines_change_places,
    "summary's success": _in_json("summary.json", lambda s: s.update(success=1.0)),
    "summary's outcomes": _in_json("summary.json", lambda s: s.update(outcomes={"inserted": 3})),
    "summary's peak force": _in_json("summary.json", lambda s: s.update(peak_force_N=1.0)),
    "summary's arm": _in_json("summary.json", lambda s: s.update(arm="ur5")),
    "summary's seed": _in_json("summary.json", lambda s: s.update(seed=7)),
    "no summary": lambda folder: _write(folder / "summary.json", lambda _: b"[]"),
}
"""Here the manifest is made good as well."""

TAMPERINGS: dict[str, Tampering] = {
    "first log gone": gone("logs/trial-00000.mcap"),
    "log cut": cut("logs/trial-00001.mcap"),
    "log of another run in its place": lambda f: shutil.copy(GOLDEN / "train-paper.mcap", f / "logs/trial-00001.mcap"),
    "log added": lambda f: shutil.copy(f / "logs/trial-00001.mcap", f / "logs/trial-00007.mcap"),
    "two logs change places": _two_logs_change_places,
    "a log's command": log_with("/tick", 40, one_ulp("asked_rad", 1)),
    "a log's true peak force": log_with("/end", 0, one_ulp("true_peak_force_N")),
    "a log's versions": log_with("/start", 0, in_start(versions_json={"palpate": "9"})),
    "a log's time of receipt": log_with("/tick", 9, lambda made: setattr(made.wrench, "receive_time_ns", 1)),
    "a log's learner": log_with("/start", 0, _set(learner_json="")),
    "a log's outcome": log_with("/end", 0, _set(outcome="inserted", success=True)),
    "a log's end gone": log_with("/end", 0, _set(error="KeyboardInterrupt", outcome="")),
    "policy gone": gone("policy.json"),
    "policy's value": _in_json("policy.json", lambda p: p.update(schema=p["schema"])),
    "policy's thresholds": swapped("policy.json", "-0.001", "-0.002"),
    "trials gone": gone("trials.csv"),
    "a trial's outcome": swapped("trials.csv", "time limit", "inserted"),
    "a trial's line gone": lambda f: _write(f / "trials.csv", lambda d: b"".join(d.splitlines(True)[:-1])),
    "a trial's line added": lambda f: _write(f / "trials.csv", lambda d: d + d.splitlines(True)[-1]),
    "a decision's action": swapped("decisions.csv", ",+", ",-"),
    "settings": swapped("run.toml", "seed = 0", "seed = 1"),
    "settings gone": gone("run.toml"),
    "checkpoint": swapped("checkpoint.json", '"next_trial": 3', '"next_trial": 2'),
    "summary": swapped("summary.json", '"trials": 3', '"trials": 4'),
    "picture": cut("learning_curve.png", 0.9),
    "manifest's digest": _in_json("manifest.json", lambda m: m["files"]["policy.json"].update(sha256="0" * 64)),
    "manifest's entry": _in_json("manifest.json", lambda m: m["files"].pop("policy.json")),
    "manifest's number of trials": _in_json("manifest.json", lambda m: m.update(trials=4)),
    "a log's number": lambda f: (f / "logs/trial-00002.mcap").rename(f / "logs/trial-00003.mcap"),
    "a log's reinforcement": log_with("/reinforcement", 0, one_ulp("reinforcement")),
    "a trial's line added, and the manifest made good": _a_trial_more_and_the_manifest_made_good,
    "manifest and settings gone": _no_manifest_and_no_settings,
    "table of a comparison added": lambda f: _write(shutil.copy(f / "trials.csv", f / "compare.csv"), bytes),
}  # fmt: skip


@cache
def _replayed(path: Path, content: bytes) -> Replay:
    return replay_file(path, Rebuilder())


@pytest.mark.parametrize("kind", [*TAMPERINGS, *MADE_GOOD])
def test_a_folder_that_was_tampered_with(
    palpate: CommandLine, run: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Most leave all logs as they are: one of the same name and bytes is replayed once.
    monkeypatch.setattr(batch, "replay_file", lambda path, _, **none: _replayed(path, path.read_bytes()))
    (TAMPERINGS | MADE_GOOD)[kind](run)
    if kind in MADE_GOOD:
        _made_good(run)
    done = palpate("replay", "run", "--jobs", 1)
    assert done.code in (1, 2), done


def test_a_whole_folder_is_called_whole(palpate: CommandLine, trained: Path) -> None:
    assert "folder:" not in palpate.succeed("replay", trained, "--jobs", 1)
    # The folder of its logs stands for it.
    assert "no manifest" not in palpate.succeed("replay", trained / "logs", "--jobs", 1)


def test_a_manifest_of_another_run_is_refused_in_one_line(palpate: CommandLine, run: Path) -> None:
    _in_json("manifest.json", _other_digests)(run)
    line = palpate.refusal("replay", "run", "--jobs", 1)
    assert "run/manifest.json: is that of another run" in line
    line = palpate.refusal("train", "--resume", "--out", "run", "--trials", 9, "--task.time-limit-s", 0.5)
    assert "run/manifest.json: is that of another run" in line


def _other_digests(manifest: Any) -> None:
    for told in manifest["files"].values():
        told["sha256"] = "0" * 64


def test_in_a_run_that_was_cut_short_logs_before_the_newest_trial_s_are_missed(palpate: CommandLine, run: Path) -> None:
    files = ("run.toml", "trials.csv", "decisions.csv")

    def cut_short(manifest: Any) -> None:
        manifest.update(finished=False, files={name: manifest["files"][name] for name in files})

    _in_json("manifest.json", cut_short)(run)
    gone("logs/trial-00002.mcap")(run)
    gone("policy.json")(run)
    assert "cut short after 3 trials" in palpate.succeed("replay", "run", "--jobs", 1)
    gone("logs/trial-00001.mcap")(run)
    assert "trial-00001.mcap: is missing" in palpate("replay", "run", "--jobs", 1).stdout


def test_what_a_single_log_cannot_be_checked_for_is_named(palpate: CommandLine, trained: Path) -> None:
    printed = palpate.succeed("replay", trained / "logs" / "trial-00001.mcap")
    assert "not checked, for only the world and the recorder know it: the true peak force;" in printed


def test_differences_as_a_table_for_a_review(palpate: CommandLine, run: Path) -> None:
    log_with("/tick", 40, one_ulp("asked_rad", 1))(run)
    assert palpate("replay", "run", "--jobs", 1, "--markdown", "table.md").code == 1
    lines = Path("table.md").read_text().splitlines()
    assert lines[0] == "| log | outcome before | outcome after | first tick | field | result |"
    assert lines[2].startswith("| run/logs/trial-00001.mcap | time limit | ")
    assert lines[2].endswith("| 40 | /tick asked_rad[1] | DIVERGED |")
    assert lines[-1] == "2 of 3 logs replay equal in every bit."
    assert "is there already" in palpate.refusal("replay", "run", "--jobs", 1, "--markdown", "table.md")


def _made_good(folder: Path) -> None:
    """All digests and the number of trials in the manifest are those of what is there now."""

    def good(manifest: Any) -> None:
        here = [path for path in folder.rglob("*") if path.is_file() and path.name != "manifest.json"]
        manifest["files"] = {str(path.relative_to(folder)): vars(Print.of(path)) for path in here}
        for told in manifest["files"].values():
            told["bytes"] = told.pop("size")
        manifest["trials"] = len((folder / "trials.csv").read_text().splitlines()) - 1

    _in_json("manifest.json", good)(folder)


DETERMINED = (
    {
        "trials.csv": TAMPERINGS["a trial's outcome"],
        "decisions.csv": TAMPERINGS["a decision's action"],
        "run.toml": TAMPERINGS["settings"],
        "checkpoint.json": _in_json("checkpoint.json", _one_visit_more),
        "policy.json": swapped("policy.json", '"alpha": 0.3', '"alpha": 0.4'),
    },
    {
        "trials.csv": TAMPERINGS["a trial's line gone"],
        "checkpoint.json": TAMPERINGS["checkpoint"],
        "policy.json": swapped("policy.json", '"trials_learned": 3', '"trials_learned": 4'),
    },
)


@pytest.mark.parametrize("tamperings", DETERMINED)
def test_what_the_logs_determine_is_found_though_the_manifest_was_made_good(
    palpate: CommandLine, run: Path, tamperings: dict[str, Tampering]
) -> None:
    for tamper in tamperings.values():
        tamper(run)
    _made_good(run)
    done = palpate("replay", "run", "--jobs", 1)
    assert done.code == 1
    told = {line.partition(": ")[2].partition(": ")[0] for line in done.stdout.splitlines() if "folder: " in line}
    # The summary is no more that of these trials.
    assert told == {"run/summary.json", *(f"run/{name}" for name in tamperings)}, done


def test_a_manifest_that_was_taken_away_is_missed(palpate: CommandLine, run: Path) -> None:
    gone("manifest.json")(run)
    done = palpate("replay", "run", "--jobs", 1)
    assert done.code == 1
    assert "folder: run/manifest.json: is missing" in done.stdout


@pytest.mark.parametrize("left_out", ["interrupted", "marked"])
def test_a_trial_from_which_nothing_is_kept_is_no_broken_link(
    palpate: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, left_out: str
) -> None:
    choose, calls = Agent.choose, 0

    def interrupted(agent: Agent) -> Decision:
        nonlocal calls
        calls += 1
        if calls == 14:
            signal.raise_signal(signal.SIGINT)
        return choose(agent)

    with monkeypatch.context() as patched:
        if left_out == "interrupted":
            patched.setattr(Agent, "choose", interrupted)
        else:
            monkeypatch.setattr(trial, "objections", lambda report, _: "late" if report.setup.index == 0 else "")
        palpate("train", "--task.time-limit-s", 1, "--trials", 2, "--out", "run")
    assert "folder: " not in palpate.succeed("replay", "run", "--jobs", 1)
