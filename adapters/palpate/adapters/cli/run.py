"""``palpate run``."""

import sys
from contextlib import ExitStack
from pathlib import Path

from palpate.adapters.cli.notices import (
    marked_line,
    print_weakened,
    unrecorded,
)
from palpate.adapters.cli.opening import opened_recorder, opened_rig
from palpate.adapters.cli.options import RunOptions
from palpate.adapters.cli.progress import progress
from palpate.adapters.experiments import (
    NOBODY_KNOWS,
    ChosenPolicy,
    RunFolder,
    next_free_folder,
    policy_for,
    ready_pose,
    require_usable,
    run_chosen,
    run_toml,
    write_evaluation,
)
from palpate.core.errors import ConfigurationError


def run(options: RunOptions) -> int:
    """Run a policy and print what came of it; returns the exit code."""
    with ExitStack() as kept:
        return _run(options, kept)


def _run(options: RunOptions, kept: ExitStack) -> int:
    """Into a folder that ``kept`` keeps other writers out of."""
    config = options.run
    named = policy_for(config, options.policy)
    folder = RunFolder(Path(options.out)) if options.out else next_free_folder(f"runs/{config.scenario}-run")
    folder.require_free()
    if options.policy.startswith("omniscient") and options.rig:
        raise ConfigurationError("policy", options.policy, NOBODY_KNOWS)
    chosen = ChosenPolicy(named, config)
    ready = ready_pose(config)
    require_usable(config, ready, options.rig)
    print_weakened(config)
    with ExitStack() as opened:
        live, rig = opened_rig(opened, options, config, ready)
        # Only now are words, files and devices known to be good: a refused call must not leave a folder in the way.
        kept.enter_context(folder.writing())
        folder.write("run.toml", run_toml(config, "run", trials=options.trials, policy=named))
        recorder, session = opened_recorder(opened, kept, options, config, folder, live)
        with progress(options.trials, "trial", chosen.label) as bar:
            rows = run_chosen(
                chosen, config, ready, rig, options.trials,
                folder=folder, recorder=recorder, session=session, on_trial=bar.update,
            )  # fmt: skip
    summary = write_evaluation(config, folder, named, chosen.document, rows, options.trials)
    if session is not None:
        sys.stdout.write(session.report() + "\n")
    low, high = summary["success_95"]
    sys.stdout.write(
        f"{options.policy or chosen.label}, {config.arm}, scenario {config.scenario}, seed {config.seed}:"
        f" {len(rows)} trials\n"
        f"success {summary['success']:.1%} (95 % interval {low:.1%} to {high:.1%})\n"
        f"time median {summary['median_s']:.2f} s, 95th percentile {summary['p95_s']:.2f} s\n"
        f"peak force {summary['peak_force_N']:.1f} N; outcomes {summary['outcomes']}\n"
        f"{marked_line(summary)}saved in {folder.path}\n"
    )
    return int(unrecorded(recorder)) if len(rows) == options.trials else 130
