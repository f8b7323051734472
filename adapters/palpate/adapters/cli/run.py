"""The ``palpate run`` command."""

import os
import sys
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from palpate.adapters.cli import notices
from palpate.adapters.cli.options import RunOptions
from palpate.adapters.cli.progress import progress
from palpate.adapters.config import RigFile
from palpate.adapters.experiments import Claim, RunFolder, dry_run, folder_named
from palpate.adapters.hardware import DryRig
from palpate.adapters.log import counted
from palpate.adapters.mujoco import SimulatedRig
from palpate.adapters.visualisation import viewed


def run(options: RunOptions) -> int:
    """Run a policy, print the result, and return the exit code."""
    config, jobs = options.run, options.jobs or os.cpu_count() or 1
    options.require("dry", not options.dry or bool(options.rig), "given with --rig only")
    alone = bool(options.rig or options.live or options.view)
    options.require("jobs", jobs == 1 or not alone, "1 with --rig, --live or --view")
    options.require("view", not (options.view and options.rig), "left out with --rig, because it shows the simulator")
    kind = "dry" if options.dry else "run"
    folder = folder_named(options.out, f"{config.scenario}-{kind}")
    claim = Claim.parse(options.claim) if options.claim else None
    if options.dry:
        return _dry(options, folder)
    with ExitStack() as opened:
        this = notices.run_of(options, opened.enter_context(notices.watched(options)))
        label = this.chosen(options.policy).label
        folder.require_free()
        # The operator confirms and the viewer opens before any progress is shown.
        rig = opened.enter_context(this.opened()) if options.view or options.rig else None
        if isinstance(rig, SimulatedRig):
            opened.enter_context(viewed(rig))
        bar = opened.enter_context(progress(options.trials, "trial", label))

        def finished(trials: int) -> None:
            if options.rig:
                bar.write(notices.trial_line(folder.read_trials()[-1]), sys.stdout)
            bar.update(trials)

        opened.enter_context(notices.logs_named(options, folder))
        result = this.evaluate(options.trials, options.policy, folder.path, jobs=jobs, claim=claim, on_trial=finished)
    summary = result.summary
    verdict = summary.get("verdict", "")
    trials = counted(len(result.rows), "trial")
    sys.stdout.write(
        (f"{result.timing}\n" if result.timing else "")
        + f"{options.policy or label}, {config.arm}, scenario {config.scenario}, seed {config.seed}: {trials}\n"
        + (_rates(options, summary) if result.rows else "")
        + (f"claim {claim}: {verdict}\n" if claim else "")
        + f"{notices.trips_line(summary)}{notices.flagged_line(summary)}saved in {folder.path}\n"
    )
    if not result.finished:
        return 130
    return 1 if result.losses or verdict not in ("", "proved") else 0


def _rates(options: RunOptions, summary: Mapping[str, Any]) -> str:
    low, high = summary["success_95"]
    outcomes = ", ".join(f"{count} {outcome}" for outcome, count in summary["outcomes"].items())
    return (
        f"success {summary['success']:.1%} (95 % interval {low:.2%} to {high:.2%})\n"
        f"{notices.validity_note(options.run, options.rig)}"
        f"time median {summary['median_s']:.2f} s, 95th percentile {summary['p95_s']:.2f} s\n"
        f"peak force {summary['peak_force_N']:.1f} N; outcomes: {outcomes}\n"
    )


def _dry(options: RunOptions, folder: RunFolder) -> int:
    """Run the start of a trial with sensors and encoders only, and print the measurements."""
    file = RigFile.load(Path(options.rig))
    rig = DryRig(file, options.run)
    scored, lines, recording = dry_run(notices.run_of(options, make_rig=lambda *_: rig), options.policy, folder)
    power = (
        "the arm was switched on, because its adapter gives no angles otherwise"
        if rig.is_on
        else "the arm got no power"
    )
    lines = [f"dry run: no command was sent, {power}", options.run.part.describe(), *lines]
    if scored.trip:
        lines.append(f"ended by {scored.cause}")
    lines.append(recording.timing)
    sys.stdout.write("\n".join((*lines, f"saved in {folder.path}")) + "\n")
    return 1 if scored.trip or recording.losses else 0
