"""The ``palpate train`` command."""

import os
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from palpate.adapters import experiments
from palpate.adapters.cli import notices
from palpate.adapters.cli.options import TrainOptions
from palpate.adapters.cli.progress import progress
from palpate.adapters.config import scenario
from palpate.adapters.experiments import save_policy
from palpate.adapters.files import new_folder, require_free_folder
from palpate.adapters.log import counted, find_logs
from palpate.core.errors import UsageError


def train(options: TrainOptions) -> int:
    """Train a policy, or resume its training, and write the run folder; return the exit code."""
    if options.from_logs:
        return _fit_to_logs(options)
    config, folder = options.run, experiments.RunFolder(Path(options.out or f"runs/{options.run.scenario}"))
    if options.resume:
        made = experiments.Checkpoint.load(folder).next_trial
        if made >= options.trials and folder.summary().get("trials") == made:
            again = notices.command("train", "--resume", "--out", folder.path, "--trials", made + 50)
            notices.say(f"{folder.path} is finished: {made} of {options.trials} trials; 50 more: {again}")
            notices.say(_look_at(folder))
            return 0
    with notices.logs_named(options, folder), ExitStack() as shown:
        live = shown.enter_context(notices.watched(options))
        bars, rows = list[Any](), list[experiments.TrialRow]()

        def begin(_: experiments.RunFolder, first: int) -> None:
            which = f"trial {first + 1} to {options.trials}" if first else counted(options.trials, "trial")
            run = f"{config.arm}, scenario {config.scenario}, seed {config.seed}"
            notices.say(f"{run}: {which}, results in {folder.path}")
            rows.extend(folder.read_trials())
            bars.append(shown.enter_context(progress(options.trials, "trial", initial=first)))

        def finished(scored: experiments.ScoredTrial) -> None:
            rows.append(experiments.TrialRow.of(scored))
            if options.rig:
                bars[0].write(notices.trial_line(rows[-1]), sys.stdout)
            bars[0].set_postfix_str(_lately(rows[-experiments.WINDOW :]))
            bars[0].update()

        result = notices.run_of(options, live).train(
            options.trials, folder.path, options.policy,
            resume=options.resume, on_begin=begin, on_trial=finished,
        )  # fmt: skip
    if result.timing:
        notices.say(result.timing)
    if result.rows:
        notices.say(f"{results_line(result.rows)}\n{notices.validity_note(config, options.rig)}".rstrip())
        learned = config.acceptance.learn_from_flagged
        for line in (notices.trips_line(result.summary), notices.flagged_line(result.summary, learned=learned)):
            if line:
                notices.say(line.rstrip())
        notices.say(_look_at(folder))
    if not result.finished:
        policy = ["--policy", options.policy] if os.path.exists(options.policy) else []
        again = notices.command("train", "--resume", "--out", folder.path, "--trials", options.trials, *policy)
        notices.say(f"ended after {len(result.rows)} of {options.trials} trials; resume with: {again}")
        return 130
    return int(bool(result.losses))


def _fit_to_logs(options: TrainOptions) -> int:
    """Fit a belief to recorded trials, print a report, save the belief, and return the exit code."""
    # Imported here, because training in trials does not need it.
    from palpate.adapters.replay import contacts_of

    if not options.out:
        raise UsageError("palpate train --from-logs needs --out, a folder for the policy")
    options.run.require("learner", options.run.learner == "belief", "'belief', the learner that is fitted to logs")
    only = TrainOptions(out=options.out, from_logs=options.from_logs, learner=options.learner)
    if options != only.with_run(scenario("paper", "belief")):
        raise UsageError("palpate train --from-logs takes no other flag than --out; the logs hold the settings")
    require_free_folder(Path(options.out))
    paths = find_logs(options.from_logs)
    with progress(len(paths), "log", passing=True) as bar:
        found = contacts_of(paths, lambda: bar.update())
    with new_folder(Path(options.out)) as folder:
        save_policy(found.document, folder / "policy.json")
        facts = {"from_logs": list(options.from_logs)}
        (folder / "run.toml").write_text(experiments.run_toml(found.config, "train", **facts), encoding="utf-8")
    for line in found.left_out:
        sys.stderr.write(f"left out: {line}\n")
    table = experiments.render_table(found.document).rstrip("\n")
    notices.say(f"{found.inserted} of {len(paths)} trials ended in the hole\n{table}".rstrip("\n"))
    notices.say(f"saved in {options.out}")
    return 0


def _lately(rows: Sequence[experiments.TrialRow]) -> str:
    """Return the mean time and the success rate over the last trials."""
    count, temperature = len(rows), rows[-1].temperature
    text = f"time {sum(row.exploration_time_s for row in rows) / count:.2f} s"
    text += f", success {sum(row.success for row in rows) / count:.0%}"
    return text if temperature is None else f"{text}, temperature {temperature:.2f}"


def results_line(rows: Sequence[experiments.TrialRow]) -> str:
    """Summarise the first and last trials without overlap."""
    count, times, wins = len(rows), [row.exploration_time_s for row in rows], [row.success for row in rows]
    if count <= experiments.WINDOW:
        return f"{counted(count, 'trial')}, mean time {sum(times) / count:.2f} s; success: {sum(wins)} of {count}"
    some = min(experiments.WINDOW, count // 2)
    return (
        f"{count} trials, mean time {sum(times[:some]) / some:.2f} s in the first {some} and "
        f"{sum(times[-some:]) / some:.2f} s in the last {some}; "
        f"success in the last {some}: {sum(wins[-some:])} of {some}"
    )


def _look_at(folder: experiments.RunFolder) -> str:
    shown = notices.command("show", folder.path / "policy.json")
    return f"look at {folder.path / 'learning_curve.png'}, or: {shown}"
