"""``palpate prove``."""

import os
import shlex
import sys
from pathlib import Path
from typing import Any

from palpate.adapters.cli.notices import print_weakened, say
from palpate.adapters.cli.study import CellProgress, jobs_of
from palpate.adapters.cli.study_options import ProveOptions
from palpate.adapters.experiments import ClaimVerdict, RunFolder, policy_for
from palpate.adapters.experiments.study import (
    Processes,
    Sequential,
    StudyFolder,
    digest_of,
    figures,
    keep,
    proving_study,
    require_possible,
    trials_of,
    worth_keeping,
)

_KEPT = "kept"


def prove(options: ProveOptions) -> int:
    """Make what is missing of the trials, judge them, and keep the worst; returns the exit code."""
    config, claim = options.run, options.claim
    policy = policy_for(config, options.policy)
    asked = proving_study(config, policy, options.trials, claim)
    folder = StudyFolder(Path(options.out or f"runs/{config.scenario}-proof"))
    files = {path: digest_of(path, setting) for path, setting in asked.files().items()}
    require_possible(asked)
    cells = list(asked.cells())
    folder.require_fits(asked, cells, files)
    with folder.opened(asked, files):
        print_weakened(config)
        finished = folder.finished(cells)
        folder.clear(cells, finished)
        missing = [cell for cell in cells if cell.name not in finished]
        say(f"{claim}: {asked.trials * len(cells)} trials in {folder.path}, {asked.trials * len(missing)} to be made")
        jobs = jobs_of(asked, folder, missing, files)
        progress, count = CellProgress(len(cells), len(finished)), options.jobs or os.cpu_count() or 1
        try:
            progress.follow(Sequential() if count == 1 else Processes(count), jobs)
        finally:
            folder.clear(cells, folder.finished(cells))
            folder.write_table(asked, cells)
        if progress.interrupted or progress.failed:
            say(f"not finished; go on with: {shlex.join(['palpate', *sys.argv[1:]])}")
            return 130 if progress.interrupted else 1
        trials = list(trials_of(folder, cells))
        found, worst = figures(claim, trials), worth_keeping(claim, trials)
        found["kept"] = {why: [[trial.seed, trial.row.trial] for trial in some] for why, some in worst.items()}
        RunFolder(folder.path).write_json("proof.json", found)
        problems = keep(asked, (trial for some in worst.values() for trial in some), folder.path / _KEPT)
    sys.stdout.write(_told(found))
    for problem in problems:
        say(f"{problem}: configuration and seed do not give it again")
    say(f"saved in {folder.path}; the slowest, the hardest and those that failed in {folder.path / _KEPT}")
    return 0 if found["verdict"] == ClaimVerdict.PROVED.value and not problems else 1


def _told(found: dict[str, Any]) -> str:
    low, high = (100.0 * share for share in found["share"])
    confidence = found["claim"]["confidence_percent"]
    lines = [
        f"{found['verdict']}: {found['ended_well']} of {found['trials']} ended well"
        f" ({confidence:g} % interval {low:.3f} to {high:.3f} %)",
        f"without success {found['not_inserted']}; success with a greater force {found['above_force']};"
        f" highest true peak {found['highest_force_N']:.1f} N",
    ]
    for name, unit in (("exploration_time_s", "s"), ("peak_force_N", "N")):
        for quantile, (value, interval) in found[name].items():
            ends = "no interval from so few" if interval is None else f"{interval[0]:.2f} to {interval[1]:.2f}"
            lines.append(f"{name.rpartition('_')[0].replace('_', ' ')}, {quantile}: {value:.2f} {unit} ({ends})")
    return "".join(f"{line}\n" for line in lines)
