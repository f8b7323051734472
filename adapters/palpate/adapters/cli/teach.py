"""``palpate teach``."""

import os
import sys
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from palpate.adapters.cli.notices import (
    print_weakened,
    say,
    unrecorded,
)
from palpate.adapters.cli.opening import opened_recorder, opened_rig
from palpate.adapters.cli.options import TeachOptions
from palpate.adapters.config import task_kind
from palpate.adapters.experiments import (
    FIRST_EVALUATION_TRIAL,
    RunFolder,
    ScoredTrial,
    configured_perception,
    learning_policy,
    next_free_folder,
    perception_settings,
    ready_pose,
    require_usable,
    run_toml,
    simulated_perception,
    task_actions,
    write_evaluation,
)
from palpate.adapters.experiments.teaching import (
    EXAMPLES_FILE,
    KEYS_HELP,
    Gamepad,
    Hand,
    Keys,
    Shown,
    Teacher,
    examples_text,
    slowed,
    taught_table,
    teach_trials,
)
from palpate.adapters.log import PERSON, made_with
from palpate.core.errors import ConfigurationError, UsageError
from palpate.core.perception import Perception
from palpate.core.policy import COMPASS_NAMES, Observation, document_of
from palpate.core.ports import CONTROL_RATE_HZ


def teach(options: TeachOptions) -> int:
    """Let a person show what to do, and leave it in a folder; returns the exit code."""
    with ExitStack() as kept:
        return _teach(options, kept)


def _teach(options: TeachOptions, kept: ExitStack) -> int:
    """Into a folder that ``kept`` keeps other writers out of."""
    config = options.run
    if not task_kind(config.task.name).asks_policy:
        raise ConfigurationError("task.name", config.task.name, "a task that lets a policy choose; this one asks none")
    if options.guide_N and not options.rig:
        raise ConfigurationError("guide_N", options.guide_N, "0 without --rig: nobody can push a simulated tool")
    if options.rig:
        config = slowed(config)
    folder = RunFolder(Path(options.out)) if options.out else next_free_folder(f"runs/{config.scenario}-teach")
    folder.require_free()
    actions = task_actions(config)
    if (names := [action.name for action in actions])[: len(COMPASS_NAMES)] != list(COMPASS_NAMES):
        accepted = "the eight steps of keys and sticks, by task.directions = 8 and without skills"
        raise ConfigurationError("actions", ", ".join(names), accepted)
    if config.learning.examples:
        raise ConfigurationError("learning.examples", config.learning.examples, "none: a lesson leaves its own")
    ready = ready_pose(config)
    require_usable(config, ready, options.rig)
    print_weakened(config)
    examples: list[Shown] = []
    with ExitStack() as opened:
        hand = opened.enter_context(_hand(options))
        live, rig = opened_rig(opened, options, config, ready)
        if configured_perception(config) is None:
            say(f"fitting perception on {config.perception.fit_trials} random-walk trials in the simulator")
        perception = simulated_perception(config, ready)
        # What is made of the examples in the end is refused before a person has shown any.
        learning_policy(config, perception)
        kept.enter_context(folder.writing())
        folder.write("run.toml", run_toml(config, "teach", trials=options.trials))
        recorder, session = opened_recorder(opened, kept, options, config, folder, live)
        sys.stderr.write(f"palpate: {_how_to(options)}\n")
        # A step on a rig leaves no time to read, nor for a slow terminal.
        tell = _tell if not options.rig and sys.stderr.isatty() else _say_nothing
        teacher = Teacher(hand, perception.states, actions, tell, guided=options.guide_N > 0.0)

        def done(scored: ScoredTrial, shown: list[Shown]) -> None:
            folder.append_trial(scored, FIRST_EVALUATION_TRIAL)
            number, outcome = scored.report.setup.index - FIRST_EVALUATION_TRIAL + 1, scored.report.outcome
            if scored.success:
                examples.extend(shown)
                # At once: what is shown outlives whatever ends the lesson.
                folder.write(EXAMPLES_FILE, examples_text(examples))
            fate = f"{len(shown)} examples" if scored.success else "nothing is taken from it"
            line = "\n" if tell is _tell else ""
            sys.stderr.write(f"{line}trial {number} of {options.trials}: {outcome.value if outcome else ''}, {fate}\n")
            sys.stderr.flush()

        rows = teach_trials(config, ready, rig, perception, teacher, options.trials, done, recorder, session)
        if session is not None:
            say(session.report())
    if tell is _tell and hand.ended():
        # The cursor stands behind the step that was not taken.
        sys.stderr.write("\n")
    _leave(options, folder, perception, examples)
    if rows:
        write_evaluation(config, folder, PERSON, None, rows, len(rows))
    return int(unrecorded(recorder)) or (0 if len(rows) == options.trials else 130)


def _leave(options: TeachOptions, folder: RunFolder, perception: Perception, examples: list[Shown]) -> None:
    """What was taught: as a file of examples, as a policy that has learned nothing else, and as a table."""
    if not examples:
        say(f"no trial succeeded, so nothing was taught; logs are in {folder.path}")
        return
    path, config = folder.path / EXAMPLES_FILE, options.run
    learned_by = replace(config, learning=replace(config.learning, examples=str(path)))
    policy = learning_policy(learned_by, perception)
    document = document_of(policy, created_with=made_with(), perception=perception_settings(config, perception))
    document.save(folder.path / "policy.json")
    say(taught_table(perception.states, task_actions(config), examples).rstrip())
    say(f"{len(examples)} examples in {path}; learn the rest: palpate train --learning.examples {path}")
    say(f"or use them as they are: palpate run --policy {folder.path / 'policy.json'}")


def _hand(options: TeachOptions) -> Hand:
    action_s = options.run.task.ticks_per_action / CONTROL_RATE_HZ
    if options.gamepad:
        return Gamepad(options.gamepad, options.hold_button if options.rig else None, options.guide_N, action_s)
    if options.rig:
        raise UsageError("--rig needs --gamepad DEVICE: there any key of the terminal stops the arm")
    return Keys(sys.stdin.fileno())


def _how_to(options: TeachOptions) -> str:
    if options.rig:
        lead = f"push the tool with {options.guide_N:g} N" if options.guide_N else "lead it with the stick"
        return f"for each trial press button {options.hold_button} anew, hold it and {lead}; any key stops the arm"
    return "left stick or cross: a step; Ctrl-C: end" if options.gamepad else KEYS_HELP


def _say_nothing(observation: Observation, state: str) -> None:
    return


def _tell(observation: Observation, state: str) -> None:
    """One line that is written over itself: where the peg is, and what is felt."""
    x, y = (1e3 * value for value in observation.reference_m[:2])
    tx, ty = (1e3 * value for value in observation.torque_Nm[:2])
    force_N = -observation.force_N[2]
    text = f"step {observation.action_number + 1}: x {x:+.1f} y {y:+.1f} mm, {force_N:.1f} N,"
    text = f"{text} torque {tx:+.0f} {ty:+.0f} mN m: {state}"
    width = os.get_terminal_size(sys.stderr.fileno()).columns - 1 if sys.stderr.isatty() else len(text)
    sys.stderr.write(f"\r{text[:width].ljust(width)}")
    sys.stderr.flush()
