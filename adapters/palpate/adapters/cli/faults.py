"""``palpate faults``."""

import os
import sys
from pathlib import Path

from palpate.adapters.cli.notices import print_weakened
from palpate.adapters.cli.options import FaultsOptions
from palpate.adapters.cli.progress import progress
from palpate.adapters.config import task_kind
from palpate.adapters.experiments import ChosenPolicy
from palpate.adapters.fault_injection.campaign import Choice, Class, FaultRun, as_csv, cases, run_cases, summary, table
from palpate.core.ports import new_file, require_no_file


def faults(options: FaultsOptions) -> int:
    """Run the campaign; 0 if no run failed, else 1."""
    out = Path(options.out) if options.out else None
    if out is not None:
        require_no_file(out)
    policy = options.policy or ("torque" if task_kind(options.run.task.name).asks_policy else "")
    ChosenPolicy(policy, options.run)
    print_weakened(options.run)
    chosen = cases(options.run, options.seeds, Choice(options.most, options.group, options.phase, options.fault))
    runs: list[FaultRun] = []
    try:
        with progress(len(chosen), "run") as bar:
            for part in run_cases(
                options.run,
                chosen,
                policy=policy,
                rig_file=options.rig,
                supervised=options.supervisor,
                jobs=options.jobs or os.cpu_count() or 1,
            ):
                runs += part
                bar.update(len(part))
    finally:
        # Devices may fail for good on the way: what was learned until then is not lost.
        if runs:
            sys.stdout.write(table(runs, by_phase=options.by_phase) + "\n" + summary(runs))
            if out is not None:
                with new_file(out) as passing:
                    passing.write_text(as_csv(runs), encoding="utf-8")
    return 1 if any(run.verdict in (Class.FAILED, Class.FALSE_SUCCESS) for run in runs) else 0
