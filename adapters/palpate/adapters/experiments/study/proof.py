"""A proof: a study of one policy over many seeds, judged as a whole; its hardest trials are made again and recorded."""

import os
import tomllib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from heapq import nlargest
from math import ceil
from pathlib import Path
from typing import Any, Final

import numpy as np

from palpate.adapters.config import RecordingConfig, RunConfig, to_toml
from palpate.adapters.experiments.build import build_task, open_rig, ready_pose, supervisor_of
from palpate.adapters.experiments.claim import Claim
from palpate.adapters.experiments.evaluation import FIRST_EVALUATION_TRIAL, ChosenPolicy
from palpate.adapters.experiments.results import RunFolder, TrialRow
from palpate.adapters.experiments.statistics import quantile_interval
from palpate.adapters.experiments.study.cell import StudyCell
from palpate.adapters.experiments.study.document import Study
from palpate.adapters.experiments.study.fields import leaves
from palpate.adapters.experiments.study.folder import StudyFolder
from palpate.adapters.experiments.trial import run_scored_trial
from palpate.adapters.log import LOG_FOLDER, read_log, timeline, trial_name
from palpate.core.errors import ConfigurationError
from palpate.core.ports import write_whole

PER_SEED: Final = 50
"""Trials of a seed: a piece of work for one process, and what is lost when it is cut short."""
_NOT_OF_THE_STUDY: Final = ("seed", "recording")
_QUANTILES: Final = (0.5, 0.95, 0.99, 0.999)
_KEPT: Final = 3
"""So many of the slowest and of the hardest trials are kept, and..."""
_KEPT_FAILURES: Final = 20
"""...so many of those that did not end well."""


def proving_study(config: RunConfig, policy: str, trials: int, claim: Claim) -> Study:
    """The study of so many trials, rounded up to whole seeds, from the configuration's seed on.

    Raises:
        ConfigurationError: So few trials cannot show the claim.
    """
    per_seed = min(trials, PER_SEED)
    seeds = ceil(trials / per_seed)
    if per_seed * seeds < claim.fewest:
        accepted = f"at least {claim.fewest}: fewer cannot show that {claim}, even if none fails"
        raise ConfigurationError("trials", trials, accepted)
    table = {name: value for name, value in tomllib.loads(to_toml(config)).items() if name not in _NOT_OF_THE_STUDY}
    return Study(
        per_seed, range(config.seed, config.seed + seeds), (policy,), leaves(table, "base"), listed=({},), grid={}
    )


@dataclass(frozen=True)
class Proven:
    """A trial of a proof."""

    seed: int
    row: TrialRow


def trials_of(folder: StudyFolder, cells: Iterable[StudyCell]) -> Iterator[Proven]:
    """The trials of finished cells."""
    for cell in cells:
        for row in RunFolder(folder.cells / cell.name).read_trials():
            yield Proven(cell.seed, row)


def figures(claim: Claim, trials: Sequence[Proven]) -> dict[str, Any]:
    """What the trials show, as plain JSON values."""
    rows = [trial.row for trial in trials]
    verdict, interval = claim.judge(rows)
    times = [row.exploration_time_s for row in rows if row.success]
    forces = [row.peak_force_N for row in rows]
    found: dict[str, Any] = {
        "claim": asdict(claim),
        "verdict": verdict.value,
        "trials": len(rows),
        "ended_well": sum(map(claim.holds, rows)),
        "not_inserted": sum(not row.success for row in rows),
        "above_force": sum(row.success and not claim.holds(row) for row in rows),
        "share": list(interval),
        "highest_force_N": max(forces),
    }
    for name, values in (("exploration_time_s", times), ("peak_force_N", forces)):
        found[name] = {
            f"{100 * q:g} %": [float(np.quantile(values, q)), quantile_interval(values, q)]
            for q in _QUANTILES
            if values
        }
    return found


def worth_keeping(claim: Claim, trials: Sequence[Proven]) -> dict[str, list[Proven]]:
    """Trials to be looked at: those that did not end well, the slowest and the hardest."""
    return {
        "failed": [trial for trial in trials if not claim.holds(trial.row)][:_KEPT_FAILURES],
        "slowest": nlargest(_KEPT, trials, key=lambda trial: trial.row.exploration_time_s),
        "hardest": nlargest(_KEPT, trials, key=lambda trial: trial.row.peak_force_N),
    }


def keep(study: Study, kept: Iterable[Proven], folder: Path) -> list[str]:
    """Make trials once more, each alone and recorded; a log and a picture each, in a folder of its seed.

    Returns:
        The trials that did not come out as in the proof, a line each; there are none, unless something else than
        configuration and seed has changed.
    """
    problems = []
    for trial in {(trial.seed, trial.row.trial): trial for trial in kept}.values():
        config = replace(study.config({}, trial.seed), recording=RecordingConfig())
        own, name = folder / f"seed-{trial.seed}", trial_name(trial.row.trial)
        log, picture = own / LOG_FOLDER / f"{name}.mcap", own / f"{name}.png"
        if not os.path.exists(picture):
            # One that was cut short has no picture.
            log.unlink(missing_ok=True)
            again = _recorded(config, study.policies[0], trial.row.trial, own)
            write_whole(picture, timeline(read_log(log)))
            if again != trial.row:
                problems.append(f"{own / name}: {again.outcome} now, {trial.row.outcome} in the proof")
    return problems


def _recorded(config: RunConfig, policy: str, number: int, folder: Path) -> TrialRow:
    chosen, ready = ChosenPolicy(policy, config), ready_pose(config)
    with ExitStack() as opened:
        rig = opened.enter_context(open_rig(config, ready, ""))
        acting = chosen.on(rig)
        task = build_task(config, ready, chosen.perception, acting)
        recorder = RunFolder(folder).recorder(config.recording, opened)
        if recorder is not None:
            recorder.of("prove", config, ready, task, chosen.perception, acting, name=chosen.comparator)
        scored = run_scored_trial(
            config, rig, task, FIRST_EVALUATION_TRIAL + number, recorder, FIRST_EVALUATION_TRIAL,
            supervisor_of(rig, config, ready),
        )  # fmt: skip
    return TrialRow.of(scored, FIRST_EVALUATION_TRIAL)
