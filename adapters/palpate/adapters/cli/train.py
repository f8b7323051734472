"""``palpate train``."""

import os
import shlex
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from palpate.adapters.cli.notices import (
    marked_line,
    print_part,
    print_weakened,
    say,
    trips_line,
    unrecorded,
    validity_note,
)
from palpate.adapters.cli.opening import opened_recorder, opened_rig
from palpate.adapters.cli.options import TrainOptions
from palpate.adapters.cli.progress import progress
from palpate.adapters.config import LEARNERS, RunConfig, overlay, read_toml, run_facts, scenario, task_kind, to_toml
from palpate.adapters.experiments import (
    WINDOW,
    Checkpoint,
    RunFolder,
    ScoredTrial,
    Trainer,
    TrialRow,
    at_work,
    configured_perception,
    fitted_perception,
    foreign_code,
    foreign_entry,
    learning_policy,
    loaded_policy,
    moving_average,
    perception_of,
    ready_pose,
    render_table,
    require_usable,
    resume_from,
    run_toml,
    write_training,
)
from palpate.adapters.log import LOG_FOLDER, made_with, set_aside
from palpate.core.errors import ConfigurationError, OutputError, UsageError
from palpate.core.perception import Perception, perception_from_dict
from palpate.core.policy import Policy, PolicyDocument, learner_of
from palpate.core.ports import Rig, new_folder, require_free_folder
from palpate.core.trial import reachable_share


def train(options: TrainOptions) -> int:
    """Train, or go on training, and write the run folder; returns the exit code."""
    if options.from_logs:
        return _fit_to_logs(options)
    folder = RunFolder(Path(options.out or f"runs/{options.run.scenario}"))
    with ExitStack() as kept:
        checkpoint = None
        if options.resume:
            made = Checkpoint.load(folder).next_trial
            if made >= options.trials and folder.has_summary_of(made):
                again = f"palpate train --resume --out {shlex.quote(str(folder.path))} --trials {made + 50}"
                say(f"{folder.path} is finished: {made} of {options.trials} trials; 50 more: {again}")
                say(_look_at(folder))
                return 0
            kept.enter_context(folder.writing(again=True))
            # Read once more: whoever wrote here until now may have gone on.
            checkpoint = Checkpoint.load(folder)
            _require_same(options, folder)
        else:
            folder.require_free()
        return _train(options, folder, checkpoint, kept)


def _fit_to_logs(options: TrainOptions) -> int:
    """Fit a belief to recorded trials, report and save; returns the exit code."""
    # Loaded here, because training by trials needs neither.
    from palpate.adapters.log import find_logs
    from palpate.adapters.replay import touches_of
    from palpate.adapters.visualisation.report import touch_pictures

    if not options.out:
        raise UsageError("palpate train --from-logs needs --out, a folder for the policy")
    options.run.require("learner", options.run.learner == "belief", "'belief', the learner that is fitted to logs")
    only = TrainOptions(run=scenario("paper", "belief"), out=options.out, from_logs=options.from_logs)
    if options != only:
        raise UsageError("palpate train --from-logs takes no other flag than --out; the logs hold the settings")
    require_free_folder(Path(options.out))
    paths = find_logs(options.from_logs)
    with progress(len(paths), "log", passing=True) as bar:
        found = touches_of(paths, lambda: bar.update())
    with new_folder(Path(options.out)) as folder:
        found.document.save(folder / "policy.json")
        facts = {"from_logs": list(options.from_logs)}
        (folder / "run.toml").write_text(run_toml(found.config, "train", **facts), encoding="utf-8")
        for picture in touch_pictures(found.belief):
            (folder / "touch.png").write_bytes(picture.png)
    for line in found.left_out:
        sys.stderr.write(f"left out: {line}\n")
    say(f"{found.inserted} of {len(paths)} trials ended in the hole\n{render_table(found.document)}".rstrip("\n"))
    say(f"saved in {options.out}")
    return 0


@dataclass(frozen=True)
class _Subject:
    """What is trained.

    Attributes:
        name: As the run folder keeps it: a policy file, code of one's own, or a learner that begins from nothing.
        document: The policy file's content.
        code: Name of the code, package.module:Name; empty for none.
    """

    name: str
    document: PolicyDocument | None
    code: str

    @classmethod
    def of(cls, options: TrainOptions) -> "_Subject":
        """What the options name; raises ConfigurationError where it cannot be trained."""
        config, name = options.run, _from(options)
        asks = task_kind(config.task.name).asks_policy
        config.task.require("name", asks, "a task that lets a policy choose; this one asks none")
        code = "" if name == config.learner or os.path.exists(name) else foreign_code(name)
        document = None if code or name == config.learner else PolicyDocument.load(Path(name))
        brought = config.learning.programmed or config.learning.examples
        if (document is not None or code) and brought:
            accepted = (
                "nothing programmed and no examples beside --policy FILE or package.module:Name, which brings its own"
            )
            raise ConfigurationError("learning.programmed", brought, accepted)
        if code:
            foreign_entry(code)
        return cls(name, document, code)

    def perception(self, config: RunConfig, checkpoint: Checkpoint | None) -> Perception | None:
        """How it perceives; None where that is to be fitted."""
        perception = configured_perception(config)
        if self.document is not None:
            perception = perception_of(self.document, config, perception)
        return perception if checkpoint is None else perception_from_dict(checkpoint.perception)

    def policy(self, config: RunConfig, perception: Perception, rig: Rig) -> Policy:
        """As it stands before its first trial."""
        if self.document is not None:
            policy = loaded_policy(self.document, config, perception, frozen=False)
        else:
            policy = learning_policy(config, perception, self.code)
        if learner_of(at_work(policy, rig)) is None:
            accepted = "a policy that offers what it has learned, by get_state and set_state"
            raise ConfigurationError("policy", self.name, accepted)
        return policy


def _train(options: TrainOptions, folder: RunFolder, checkpoint: Checkpoint | None, kept: ExitStack) -> int:
    """Train into a folder that ``kept`` keeps other writers out of."""
    config, subject = options.run, _Subject.of(options)
    ready = ready_pose(config)
    perception = subject.perception(config, checkpoint)
    with ExitStack() as opened:
        live, rig = opened_rig(opened, options, config, ready)
        if perception is None:
            say(f"fitting perception on {config.perception.fit_trials} random-walk trials")
            perception = fitted_perception(config, ready, rig)
        policy = subject.policy(config, perception, rig)
        if checkpoint is not None:
            resume_from(checkpoint, policy, rig)
        # Only now is every setting known to be good: a refused one must not leave a folder that is in the way.
        require_usable(config, ready, options.rig)
        if checkpoint is None:
            kept.enter_context(folder.writing())
        recorder, session = opened_recorder(opened, kept, options, config, folder, live)
        first = 0 if checkpoint is None else checkpoint.next_trial
        trainer = Trainer(config, folder, ready, rig, perception, policy, first, recorder, session)
        if checkpoint is None:
            folder.write("run.toml", run_toml(config, "train", trials=options.trials, policy=subject.name))
        else:
            _cut_back(folder, first)
        trainer.checkpoint()
        _announce(config, folder, options.trials, first)
        if live is not None and first:
            live.note(0, f"goes on after {first} trials", folder.read_trials())
        print_part(config, options.rig)
        print_weakened(config)
        _with_progress(trainer, options.trials, first, folder)
        trainer.save_policy()
    if session is not None:
        say(session.report())
    _finish(config, folder, options.trials, validity_note(config, options.rig))
    if trainer.interrupted:
        again = ["palpate", "train", "--resume", "--out", str(folder.path), "--trials", str(options.trials)]
        if subject.document is not None:
            again += ["--policy", options.policy]
        say(f"ended after {trainer.next_trial} of {options.trials} trials; go on with: {shlex.join(again)}")
        return 130
    return int(unrecorded(recorder))


def _cut_back(folder: RunFolder, first: int) -> None:
    """Take from a folder what came after the checkpoint, or refuse it where something before that is missing."""
    folder.truncate(first)
    set_aside(folder.path / LOG_FOLDER, first)
    if len(folder.read_trials()) != first:
        missing = f"does not hold the {first} finished trials"
        raise OutputError(str(folder.path / "trials.csv"), missing, "begin a new run")


def _from(options: TrainOptions) -> str:
    """What is trained: a policy file, or the name of the learner where it begins from nothing."""
    learner = options.run.learner
    if options.policy in LEARNERS and options.policy not in ("q-learning", learner):
        raise ConfigurationError("policy", options.policy, f"a policy file; --learner {options.policy} chooses it")
    return learner if options.policy in LEARNERS else options.policy


def _require_same(options: TrainOptions, folder: RunFolder) -> None:
    config, named = options.run, _from(options)
    path = folder.path / "run.toml"
    table = read_toml(path)
    facts = run_facts(table, path)
    if facts.get("policy") != named:
        raise ConfigurationError("policy", named, f"{facts.get('policy')!r}, with which the run began")
    for name, version in made_with().items():
        began = facts.get("versions", {}).get(name)
        if began != version:
            raise ConfigurationError(f"run.versions.{name}", version, f"{began!r}, with which the run began")
    saved = overlay(RunConfig(), table)
    if saved != config:
        old, new = to_toml(saved).splitlines(), to_toml(config).splitlines()
        line = next(
            (f"{b} (was {a})" for a, b in zip(old, new, strict=False) if a != b),
            "a setting that was not there",
        )
        raise ConfigurationError("resume", line, f"the configuration that the run began with, {path}")


def _announce(config: RunConfig, folder: RunFolder, trials: int, first: int) -> None:
    begin = f"trial {first + 1} to {trials}" if first else f"{trials} trials"
    say(f"{config.arm}, scenario {config.scenario}, seed {config.seed}: {begin}, results in {folder.path}")
    cell = config.cell
    share = reachable_share(config.task, cell.hole_uncertainty_mm, cell.conditions.hole_shift_mm)
    if share < 0.9995:
        say(f"only {share:.1%} of the holes lie inside the exploration area: no strategy can do much better")


def _with_progress(trainer: Trainer, trials: int, first: int, folder: RunFolder) -> None:
    rows = folder.read_trials()
    times = [row.exploration_time_s for row in rows]
    wins = [row.success for row in rows]
    with progress(trials, "trial", initial=first) as bar:

        def show(scored: ScoredTrial) -> None:
            times.append(scored.exploration_time_s)
            wins.append(scored.success)
            recent = wins[-WINDOW:]
            temperature = scored.report.temperature
            bar.set_postfix_str(
                f"time {moving_average(times[-WINDOW:])[-1]:.2f} s, success {sum(recent) / len(recent):.0%}"
                + ("" if temperature is None else f", temperature {temperature:.2f}")
            )
            bar.update()

        trainer.train(trials, show)


def _finish(config: RunConfig, folder: RunFolder, trials: int, note: str) -> None:
    rows, summary = write_training(config, folder, trials)
    if rows:
        say(f"{results_line(rows)}\n{note}".rstrip())
        for line in (trips_line(summary), marked_line(summary, learned=config.admission.learn_from_marked)):
            if line:
                say(line.rstrip())
        say(_look_at(folder))


def results_line(rows: Sequence[TrialRow]) -> str:
    """What the trials came to: the first beside the last, none of them both, where there are more than a few."""
    count, times, wins = len(rows), [row.exploration_time_s for row in rows], [row.success for row in rows]
    if count <= WINDOW:
        return f"{count} trials, mean time {sum(times) / count:.2f} s; success: {sum(wins)} of {count}"
    some = min(WINDOW, count // 2)
    return (
        f"{count} trials, mean time {sum(times[:some]) / some:.2f} s in the first {some} and "
        f"{sum(times[-some:]) / some:.2f} s in the last {some}; "
        f"success in the last {some}: {sum(wins[-some:])} of {some}"
    )


def _look_at(folder: RunFolder) -> str:
    return f"look at {folder.path / 'learning_curve.png'}, or: palpate show {folder.path / 'policy.json'}"
