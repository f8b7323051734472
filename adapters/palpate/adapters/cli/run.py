"""``palpate run``."""

import os
import sys
from collections.abc import Callable
from contextlib import ExitStack, closing
from pathlib import Path

from palpate.adapters.cli.notices import (
    marked_line,
    print_part,
    print_troubles,
    print_weakened,
    trips_line,
    validity_note,
)
from palpate.adapters.cli.opening import opened_recorder, opened_rig
from palpate.adapters.cli.options import RunOptions
from palpate.adapters.cli.progress import progress
from palpate.adapters.config import RigFile
from palpate.adapters.experiments import (
    NOBODY_KNOWS,
    ChosenPolicy,
    Claim,
    RunFolder,
    TrialRow,
    dry_trial,
    next_free_folder,
    policy_for,
    ready_pose,
    require_limits,
    require_usable,
    run_chosen,
    run_in_processes,
    run_toml,
    warm_up,
    write_evaluation,
)
from palpate.adapters.hardware import DryRig
from palpate.adapters.mujoco import SimulatedRig
from palpate.adapters.visualisation import viewed
from palpate.core.trial import ReadyPose


def run(options: RunOptions) -> int:
    """Run a policy and print what came of it; returns the exit code."""
    with ExitStack() as kept:
        return _run(options, kept)


def _run(options: RunOptions, kept: ExitStack) -> int:
    """Into a folder that ``kept`` keeps other writers out of."""
    config = options.run
    options.require("dry", not options.dry or bool(options.rig), "given with --rig only")
    named = policy_for(config, options.policy)
    kind = "dry" if options.dry else "run"
    folder = RunFolder(Path(options.out)) if options.out else next_free_folder(f"runs/{config.scenario}-{kind}")
    folder.require_free()
    options.require("policy", not (options.policy.startswith("omniscient") and options.rig), NOBODY_KNOWS)
    claim, jobs = Claim.parse(options.claim) if options.claim else None, options.jobs or os.cpu_count() or 1
    alone = bool(options.rig or options.live or options.view)
    options.require("jobs", jobs == 1 or not alone, "1 with --rig, --live or --view")
    options.require("view", not (options.view and options.rig), "the simulator, without --rig")
    chosen = ChosenPolicy(named, config)
    ready = ready_pose(config)
    require_usable(config, ready, options.rig)
    print_weakened(config)
    if options.dry:
        return _dry(options, kept, chosen, ready, folder)
    with ExitStack() as opened:
        live, rig = opened_rig(opened, options, config, ready)
        if options.view and isinstance(rig, SimulatedRig):
            opened.enter_context(viewed(rig))
        # Only now are words, files and devices known to be good: a refused call must not leave a folder in the way.
        kept.enter_context(folder.writing())
        print_part(config, options.rig)
        folder.write("run.toml", run_toml(config, "run", trials=options.trials, policy=named))
        session, troubles = None, list[str]()
        with progress(options.trials, "trial", chosen.label) as bar:
            if jobs > 1:
                rows, troubles = _in_processes(named, options, folder, jobs, bar.update)
            else:
                recorder, session = opened_recorder(opened, kept, options, config, folder, live)
                troubles = [] if recorder is None else recorder.troubles
                rows = run_chosen(
                    chosen, config, ready, rig, options.trials,
                    folder=folder, recorder=recorder, session=session, on_trial=bar.update,
                )  # fmt: skip
    summary = write_evaluation(config, folder, named, chosen.document, rows, options.trials, claim)
    verdict = summary.get("verdict", "")
    if session is not None:
        sys.stdout.write(session.report() + "\n")
    low, high = summary["success_95"]
    judged = f"claim {claim}: {verdict}\n" if claim else ""
    sys.stdout.write(
        f"{options.policy or chosen.label}, {config.arm}, scenario {config.scenario}, seed {config.seed}:"
        f" {len(rows)} trials\n"
        f"success {summary['success']:.1%} (95 % interval {low:.2%} to {high:.2%})\n"
        f"{validity_note(config, options.rig)}"
        f"{judged}"
        f"time median {summary['median_s']:.2f} s, 95th percentile {summary['p95_s']:.2f} s\n"
        f"peak force {summary['peak_force_N']:.1f} N; outcomes {summary['outcomes']}\n"
        f"{trips_line(summary)}{marked_line(summary)}saved in {folder.path}\n"
    )
    if len(rows) < options.trials:
        return 130
    return 1 if troubles or verdict not in ("", "proved") else 0


def _dry(options: RunOptions, kept: ExitStack, chosen: ChosenPolicy, ready: ReadyPose, folder: RunFolder) -> int:
    """Run the beginning of a trial on sensors and encoders alone, and print what was seen."""
    config = options.run
    warm_up(config, ready)
    with ExitStack() as opened:
        rig = opened.enter_context(DryRig(RigFile.load(Path(options.rig)), config))
        require_limits(config, ready, rig.sensor_facts)
        kept.enter_context(folder.writing())
        folder.write("run.toml", run_toml(config, "run", trials=1, policy=chosen.name))
        recorder, session = opened_recorder(opened, kept, options, config, folder, None)
        scored, lines = dry_trial(chosen, config, ready, rig, recorder, session)
    power = (
        "the arm was switched on, for its adapter gives no angles otherwise" if rig.is_on else "the arm got no power"
    )
    lines = [f"dry run: no command was sent, {power}", config.part.describe(), *lines]
    if scored.trip:
        lines.append(f"ended by {scored.cause}")
    if session is not None:
        lines.append(session.report())
    sys.stdout.write("\n".join((*lines, f"saved in {folder.path}")) + "\n")
    return 1 if scored.trip or (recorder is not None and recorder.troubles) else 0


def _in_processes(
    name: str, options: RunOptions, folder: RunFolder, jobs: int, on_trials: Callable[[int], object]
) -> tuple[list[TrialRow], list[str]]:
    """Return the trials until all are run or Ctrl-C ends them, and what could not be recorded."""
    rows, troubles = list[TrialRow](), list[str]()
    with closing(run_in_processes(name, options.run, options.trials, folder, jobs)) as blocks:
        try:
            for done, lost in blocks:
                rows += done
                troubles += lost
                on_trials(len(done))
        except KeyboardInterrupt:
            # A block may have been written and not yet counted.
            rows = folder.read_trials()
    print_troubles(troubles)
    return rows, troubles
