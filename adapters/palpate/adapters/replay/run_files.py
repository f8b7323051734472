"""What a trial determines of the other files of its run: a manifest's digests can be made good, these cannot."""

import csv
import hashlib
import json
import tomllib
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from palpate.adapters.config import RunConfig, read_toml
from palpate.adapters.experiments import (
    RUN_FILES,
    RunFolder,
    ScoredTrial,
    read_manifest,
    rows_of,
    score,
    summary_of,
)
from palpate.adapters.log import LOG_FOLDER, TrialLog, csv_text
from palpate.adapters.replay.rebuild import Rebuilt
from palpate.core.errors import OutputError, PalpateError, one_line
from palpate.core.policy import PolicyDocument, document_of
from palpate.core.ports import json_of_file
from palpate.core.trial import Outcome, TrialReport


@dataclass(frozen=True)
class Determined:
    """What one trial determines of its run's files.

    Attributes:
        trial: Its number in the run, as its log is called.
        tables: Its lines in each table, as CSV below a header; none for a trial that leaves no line.
        settings: Digest of the run's settings.
        checkpoint: Digest of where a training stands after it; empty for none.
        policy: Digest of the policy after it; empty for one that no file holds.
    """

    trial: int
    tables: Mapping[str, str]
    settings: str
    checkpoint: str
    policy: str


def learner_kept(log: TrialLog, report: TrialReport, config: RunConfig) -> str:
    """State of the learner, JSON, with which a training goes on after the trial; empty where nothing learns."""
    if log.end is None:
        return ""
    left_out = score(config, report, None).marked and not config.admission.learn_from_marked
    forgotten = report.outcome is Outcome.INTERRUPTED or left_out
    return log.start.learner_json if forgotten else log.end.learner_json


def determined_by(log: TrialLog, scored: ScoredTrial, rebuilt: Rebuilt, kept: str) -> Determined | None:
    """What a log that replays equal determines; None for one that lies in no run, or lacks its end.

    Args:
        rebuilt: As the replay left it.
        kept: What :func:`learner_kept` gives.
    """
    path, start, end, report = Path(log.path), log.start, log.end, scored.report
    number = path.stem.removeprefix("trial-")
    if path.parent.name != LOG_FOLDER or not number.isdigit() or end is None or end.error:
        return None
    trial, checkpoint, policy = int(number), "", ""
    rows = {} if report.outcome is Outcome.INTERRUPTED else rows_of(scored, start.trial - trial)
    # Where nothing is kept, or a trip ends the training, it stands where the trial before left it.
    left = kept == end.learner_json and report.trip is None
    if left and kept and not start.frozen:
        ticks = json.loads(start.world_json or "{}").get("ticks")
        checkpoint = _digest(
            {
                "next_trial": trial + 1,
                "learner": json.loads(kept),
                "perception": json.loads(start.perception_json),
                "clock_ticks": 0 if ticks is None else ticks + end.ticks - 1,
            }
        )
    if left and not rebuilt.comparator and not rebuilt.recorded_decisions:
        policy = _of_policy(document_of(rebuilt.policy, created_with={}, perception={}))
    tables = {name: csv_text([columns, *lines]) for name, (columns, lines) in rows.items()}
    return Determined(trial, tables, _digest(tomllib.loads(start.config_toml)), checkpoint, policy)


def run_file_problems(logs: Mapping[Path, Determined]) -> Iterator[str]:
    """Files of runs that are not as the logs that were replayed determine them, a line each."""
    runs: dict[Path, dict[int, Determined]] = defaultdict(dict)
    for path, one in logs.items():
        runs[path.parent.parent][one.trial] = one
    for folder, trials in runs.items():
        manifest = None
        with suppress(OutputError):
            manifest = read_manifest(folder)
        newest = max(folder.glob(f"{LOG_FOLDER}/trial-*.mcap"), default=None)
        last = trials[max(trials)] if newest in logs else None
        # An older run without a manifest may have been cut short, too.
        yield from _FilesOfRun(folder, trials, last, manifest is not None and manifest.finished).problems()


@dataclass(frozen=True)
class _FilesOfRun:
    """The files of one run beside what its trials determine.

    Attributes:
        trials: What each trial that was replayed determines.
        last: The run's last trial; None where its log was not among them, or was not equal.
        whole: Whether the run came to its end.
    """

    folder: Path
    trials: Mapping[int, Determined]
    last: Determined | None
    whole: bool

    def problems(self) -> Iterator[str]:
        """What is not as determined, a line each."""
        for name in RUN_FILES:
            path = self.folder / name
            try:
                if path.is_file():
                    yield from (f"{path}: {fault}" for fault in self._faults(path))
                elif name in self._surely_left():
                    yield f"{path}: is missing, and the run left one"
            except (OSError, ValueError, KeyError, TypeError, PalpateError) as error:
                yield f"{path}: cannot be read ({one_line(error)})"

    def _surely_left(self) -> set[str]:
        if not self.whole or self.last is None:
            return set()
        learned = {"checkpoint.json", "policy.json"} if self.last.checkpoint else set[str]()
        return {"run.toml", "summary.json", *self.last.tables, *learned}

    def _faults(self, path: Path) -> Iterator[str]:
        if path.suffix == ".csv":
            yield from self._faults_of_table(path)
        elif path.name == "run.toml":
            yield from self._faults_of_settings(path)
        elif path.name == "checkpoint.json":
            yield from self._faults_of_checkpoint(path)
        elif path.name == "summary.json" and self.whole:
            yield from _faults_of_summary(path)
        elif path.name == "policy.json" and self.whole:
            yield from self._faults_of_policy(path)

    def _faults_of_settings(self, path: Path) -> Iterator[str]:
        table = read_toml(path)
        table.pop("run", None)
        if any(one.settings != _digest(table) for one in self.trials.values()):
            yield "holds other settings than the logs"

    def _faults_of_table(self, path: Path) -> Iterator[str]:
        if not any(path.name in one.tables for one in self.trials.values()):
            return
        with path.open(encoding="utf-8", newline="") as stream:
            told = _by_trial(stream)
        if list(told) != sorted(told):
            yield "has its trials in another order"
        for trial, one in sorted(self.trials.items()):
            now = _by_trial(one.tables.get(path.name, "").splitlines()).get(trial, [])
            # A run that was cut short may have come no further than to the end of its newest log.
            if one.tables and told.get(trial, []) != now and (self.whole or one is not self.last):
                yield f"is not what the log of trial {trial} gives"

    def _faults_of_checkpoint(self, path: Path) -> Iterator[str]:
        if self.last is None:
            return
        content = json_of_file(path)
        content.pop("schema")
        # That of a run that was cut short may be behind its newest log, or ahead of what was written of it.
        ended = self.whole and self.last.checkpoint
        left = self.last if ended else self.trials.get(content["next_trial"] - 1)
        if left is not None and _digest(content) != left.checkpoint != "":
            yield f"is not what trial {left.trial} left"

    def _faults_of_policy(self, path: Path) -> Iterator[str]:
        if self.last is None or not self.last.policy:
            return
        document = PolicyDocument.load(path)
        if _of_policy(replace(document, created_with={}, perception={})) != self.last.policy:
            yield f"is not the policy that trial {self.last.trial} left"


def _faults_of_summary(path: Path) -> Iterator[str]:
    figures = {**json_of_file(path)}
    settings = read_toml(path.with_name("run.toml"))
    if isinstance(settings["arm"], dict):
        settings["arm"] = settings["arm"]["name"]
    run = summary_of(RunFolder(path.parent).read_trials())
    # Times and forces of a run that does not learn are taken before its table rounds them.
    names = run if "learning" in figures else ("trials", "success", "outcomes", "marked")
    run = {name: run[name] for name in names} | {name: settings[name] for name in ("scenario", "arm", "seed")}
    wrong = [name for name, value in json.loads(json.dumps(run)).items() if figures.get(name, value) != value]
    if wrong and "policies" not in figures:
        yield f"says another {wrong[0]} than the run's trials and settings"


def _by_trial(lines: Any) -> dict[int, list[dict[str, str]]]:
    rows: dict[int, list[dict[str, str]]] = defaultdict(list)
    for cells in csv.DictReader(lines):
        rows[int(cells["trial"])].append(cells)
    return rows


def _of_policy(document: PolicyDocument) -> str:
    return _digest(json.loads(document.to_json_text()))


def _digest(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
