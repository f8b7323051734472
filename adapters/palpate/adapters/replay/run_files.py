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
from palpate.core.errors import OutputError, PalpateError
from palpate.core.policy import PolicyDocument, document_of
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
        # An older run without a manifest may have been cut short, too.
        whole = manifest is not None and manifest.finished
        newest = max(folder.glob(f"{LOG_FOLDER}/trial-*.mcap"), default=None)
        last = trials[max(trials)] if newest in logs else None
        for name in RUN_FILES:
            path = folder / name
            try:
                if not path.is_file():
                    if whole and last is not None and name in _left_by(last):
                        yield f"{path}: is missing, and the run left one"
                else:
                    yield from (f"{path}: {fault}" for fault in _faults(path, trials, last, whole=whole))
            except (OSError, ValueError, KeyError, TypeError, PalpateError) as error:
                yield f"{path}: cannot be read ({' '.join(str(error).split())})"


def _left_by(last: Determined) -> set[str]:
    """Files that a finished run has left for sure, by its last log."""
    learned = {"checkpoint.json", "policy.json"} if last.checkpoint else set[str]()
    return {"run.toml", "summary.json", *last.tables, *learned}


def _faults(path: Path, trials: Mapping[int, Determined], last: Determined | None, *, whole: bool) -> Iterator[str]:
    if path.name == "run.toml":
        table = read_toml(path)
        table.pop("run", None)
        if any(one.settings != _digest(table) for one in trials.values()):
            yield "holds other settings than the logs"
    elif path.suffix == ".csv" and any(path.name in one.tables for one in trials.values()):
        with path.open(encoding="utf-8", newline="") as stream:
            told = _by_trial(stream)
        if list(told) != sorted(told):
            yield "has its trials in another order"
        for trial, one in sorted(trials.items()):
            now = _by_trial(one.tables.get(path.name, "").splitlines()).get(trial, [])
            # A run that was cut short may have come no further than to the end of its newest log.
            if one.tables and told.get(trial, []) != now and (whole or one is not last):
                yield f"is not what the log of trial {trial} gives"
    elif path.name == "checkpoint.json" and last is not None:
        content: Any = json.loads(path.read_text(encoding="utf-8"))
        content.pop("schema")
        # That of a run that was cut short may be behind its newest log, or ahead of what was written of it.
        left = last if whole and last.checkpoint else trials.get(content["next_trial"] - 1)
        if left is not None and _digest(content) != left.checkpoint != "":
            yield f"is not what trial {left.trial} left"
    elif path.name == "summary.json" and whole:
        figures = {**json.loads(path.read_text(encoding="utf-8"))}
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
    elif path.name == "policy.json" and last is not None and last.policy and whole:
        document = PolicyDocument.load(path)
        if _of_policy(replace(document, created_with={}, perception={})) != last.policy:
            yield f"is not the policy that trial {last.trial} left"


def _by_trial(lines: Any) -> dict[int, list[dict[str, str]]]:
    rows: dict[int, list[dict[str, str]]] = defaultdict(list)
    for cells in csv.DictReader(lines):
        rows[int(cells["trial"])].append(cells)
    return rows


def _of_policy(document: PolicyDocument) -> str:
    return _digest(json.loads(document.to_json_text()))


def _digest(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
