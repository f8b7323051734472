"""Parse a command line into options and, for commands that run trials, into the run's configuration.

tyro parses a command's own options. The rest are settings such as ``--task.step-mm 0.5``. They are converted to a
table, as in a TOML file, and checked in the same way.
"""

import contextlib
import difflib
import io
import os
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, TypeVar, cast, get_args, get_origin

import tyro

from palpate.adapters.cli.commands import COMMANDS, options_of
from palpate.adapters.cli.help import flag_of, help_text, options_in
from palpate.adapters.cli.options import RunSettings
from palpate.adapters.config import (
    LEARNERS,
    OF_SOME,
    Described,
    RunConfig,
    configured,
    described,
    learner_in,
    nested,
    read_job,
    read_toml,
    run_facts,
    with_options,
)
from palpate.core.errors import ConfigurationError, UsageError
from palpate.core.ports import kinds_of, optional_of, parts_of


def _flags() -> dict[str, tuple[Described, bool]]:
    """Map each flag to its setting and to the value that it gives the setting if the setting is a switch."""
    found: dict[str, tuple[Described, bool]] = {}
    for setting in described(RunConfig):
        table, _, last = setting.name.replace("_", "-").rpartition(".")
        # Presets, arm and seed are command options.
        if table:
            found[f"--{table}.{last}"] = setting, True
            if isinstance(setting.default, bool):
                found[f"--{table}.no-{last}"] = setting, False
    return found


SETTING_FLAGS: Final = _flags()
_ANY_CASE: Final = {flag.lower(): flag for flag in SETTING_FLAGS}


def settings_in(words: Sequence[str]) -> tuple[dict[str, Any], str]:
    """Return the settings on the command line as nested tables, and the first argument that is not one, or "".

    Raises:
        UsageError: A setting has no value.
    """
    settings: dict[str, Any] = {}
    place = 0
    while place < len(words):
        word, equals, value = words[place].partition("=")
        flag = _ANY_CASE.get(word.replace("_", "-").lower(), "")
        if not flag:
            return nested(settings), words[place]
        setting, switch = SETTING_FLAGS[flag]
        end = next((n for n in range(place + 1, len(words)) if words[n].startswith("--")), len(words))
        values = [value] if equals else [*words[place + 1 : end]]
        settings[setting.name], used = _value(flag, setting.kind, values, switch)
        place += 1 if equals else 1 + used
    return nested(settings), ""


def _value(flag: str, kind: Any, values: Sequence[str], switch: bool) -> tuple[Any, int]:
    """Return the value in TOML form and the number of arguments used. The value is checked later."""
    base = parts_of(kind)[0]
    if base is bool:
        return switch, 0
    if not values:
        raise UsageError(f"{flag} needs a value")
    origin, items = get_origin(base) or base, get_args(base)
    if origin is tuple:
        if get_origin(items[0]) is tuple:
            numbers, width = [_plain(value, float) for value in values], len(get_args(items[0]))
            return [numbers[n : n + width] for n in range(0, len(numbers), width)], len(values)
        return [_plain(value, items[0]) for value in values], len(values)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        if len(values) % 2:
            raise UsageError(f"{flag} needs pairs of a name and a value (got {' '.join(values)})")
        pairs = zip(values[::2], values[1::2], strict=True)
        return {name: _plain(value, items[1]) for name, value in pairs}, len(values)
    return _plain(values[0], base), 1


def _plain(word: str, kind: Any) -> Any:
    """Return an argument as a number if the setting may be a number; otherwise, return it unchanged."""
    base = parts_of(kind)[0]
    base = optional_of(base) or base
    for number, kinds in ((int, (int, float, Any)), (float, (float, Any))):
        with suppress(ValueError):
            if base in kinds:
                return number(word)
    return word


T = TypeVar("T")

_EARNED: Final = ("reinforcement", "effort_per_N_s")
"""Reinforcement settings, which also affect the tables from a run without learning."""


def parse(kind: type[T], command: str, words: Sequence[str]) -> T:
    """Return the options given on a command line.

    Raises:
        UsageError: An argument is not an option, or its value cannot be read.
        ConfigurationError: A value is rejected.
    """
    if any(word in ("-h", "--help") for word in words):
        sys.stdout.write(help_text(kind, command))
        raise SystemExit(0)
    _require_once(kind, words)
    own, rest = _own(kind, command, words)
    if not isinstance(own, RunSettings):
        if rest:
            raise _unknown(kind, command, rest[0])
        return cast("T", own)
    given, unknown = settings_in(rest)
    if unknown:
        raise _unknown(kind, command, unknown)
    file = own.config or _resumed(own)
    table = read_toml(Path(file)) if file else {}
    facts = run_facts(table, file)
    if facts.get("command") == command:
        # A run.toml also contains the command's policy and number of trials.
        given_flags = {word.partition("=")[0] for word in words}
        known = {name: facts[name] for name in ("trials", "policy") if name in facts}
        known = {name: tuple(value) if isinstance(value, list) else value for name, value in known.items()}
        own = replace(own, **{name: value for name, value in known.items() if f"--{name}" not in given_flags})
    if command == "run" and (ignored := sorted({*given.get("learning", {})} - {*_EARNED})):
        problem = f"--learning.{ignored[0].replace('_', '-')} changes nothing: palpate run does not learn"
        raise UsageError(f"{problem}; palpate train --policy FILE does")
    return cast("T", own.with_run(_composed(own, table, bool(facts), given)))


def _require_once(kind: type, words: Sequence[str]) -> None:
    """Reject a command option that is given twice, because one of its values would be lost."""
    given = [word.partition("=")[0].replace("_", "-") for word in words]
    for name, annotation in kinds_of(kind).items():
        flag = f"--{name.replace('_', '-')}"
        if given.count(flag) > 1 and tyro.conf.UseAppendAction not in get_args(annotation):
            raise UsageError(f"{flag} is given twice; give it once, followed by all its values")


def _own(kind: type[T], command: str, words: Sequence[str]) -> tuple[Any, list[str]]:
    """Return the command's own options and all other arguments."""
    output = io.StringIO()
    try:
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
            return tyro.cli(
                kind,
                prog=f"palpate {command}",
                args=list(words),
                return_unknown_args=True,
                # Help texts are docstrings; searching the comments as well would take longer than everything else.
                config=(tyro.conf.HelptextFromCommentsOff,),
            )
    except SystemExit:
        message = _one_line(output.getvalue())
        is_own = re.match(r"learner must be .* \(got '.*:", message)
        own = "; palpate train --policy trains code of your own" if is_own else ""
        raise UsageError(message + own) from None


def _composed(own: RunSettings, table: dict[str, Any], is_record: bool, given: Mapping[str, Any]) -> RunConfig:
    """Return the configuration composed from the files, presets, rig and settings; flags override all others."""
    rig, resumed = str(getattr(own, "rig", "")), bool(getattr(own, "resume", False))
    if rig:
        if "cell" in given:
            flag = f"--cell.{next(iter(given['cell']))}"
            raise UsageError(f"{flag} sets up the simulated cell; with --rig, the rig file describes the rig")
        for tables, name in ((table, own.config), (read_job(own.job) if own.job else {}, own.job)):
            if "cell" in tables and name:
                sys.stderr.write(f"palpate: [cell] of {name} is ignored: the rig file describes the rig\n")
    named = getattr(own, "policy", "")
    policies = {learner_in(file): file for file in ([named] if isinstance(named, str) else named)}
    config = configured(
        own.job or None, rig=rig, scenario=own.scenario,
        learner=own.learner or ("belief" if getattr(own, "from_logs", ()) else ""),
        # The learner in the policy files, if they all have the same one.
        policy=next(iter(policies.values())) if len(policies) == 1 else "", task=own.task, arm=own.arm,
        settings=table, flags={**given, **({} if own.seed < 0 else {"seed": own.seed})}, measured=not resumed,
    )  # fmt: skip
    _require_of_learner(config.learner, (*given.get("learning", ()), *({} if is_record else table.get("learning", {}))))
    return with_options(config)


def _require_of_learner(learner: str, given: Iterable[str]) -> None:
    """Reject settings that the learner ignores."""
    for name in given:
        has = OF_SOME.get(name, tuple(LEARNERS))
        if learner not in has:
            raise ConfigurationError("learner", learner, f"{' or '.join(has)}, which learning.{name} is of")


def _resumed(own: RunSettings) -> str:
    """With ``--resume``, return the path to the settings that the run in ``--out`` started with."""
    if not getattr(own, "resume", False):
        return ""
    path = Path(getattr(own, "out", "") or f"runs/{own.scenario or 'paper'}") / "run.toml"
    # Not Path.exists, which raises an error if access is denied.
    return str(path) if os.path.exists(path) else ""


def _one_line(boxed: str) -> str:
    """Return the parser's error message without its title, frame and hints."""
    parts = re.split(r"[─-]{5,}", " ".join(re.sub("[╭╮╰╯│]", " ", boxed).split()))
    message = (parts[1] if len(parts) > 1 else parts[0]).strip(" ─-")
    if refused := re.search(r"Error parsing [^:]*: (\S+ (must be|is missing|=) .*)$", message):
        return refused.group(1)
    if unread := re.search(r"Error parsing (--\S+): (.*)('.*')$", message):
        flag, reason, word = unread.groups()
        return f"{flag} must be a {'whole ' * ('int' in reason)}number (got {word})"
    if bare := re.search(r"Missing value for argument '(--\S+)'", message):
        return f"{bare.group(1)} needs a value"
    if missing := re.search(r"Missing from (palpate [^:]*): \S+ (.*?)\.? \(required\)", message):
        return f"{missing.group(1)} needs a further argument: {missing.group(2)}"
    return message


def flags_of(kind: type) -> set[str]:
    """Return every flag for a command, including those for its settings."""
    found = set(SETTING_FLAGS) if issubclass(kind, RunSettings) else set()
    _, flags, rare = options_in(kind)
    for option in (*flags, *rare):
        found.add(flag_of(option))
        if parts_of(option.kind)[0] is bool:
            found |= {f"--{option.name.replace('_', '-')}", f"--no-{option.name.replace('_', '-')}"}
    return found


def _unknown(kind: type, command: str, word: str) -> UsageError:
    word = word.split("=", 1)[0].replace("_", "-")
    flags, last = sorted(flags_of(kind)), word.rpartition(".")[2]
    # The same name in another table is a closer match than a similar name.
    near = sorted((flag for flag in flags if "." in word and flag.endswith(f".{last}")), key=len)
    near = near or difflib.get_close_matches(word, flags, n=1, cutoff=0.6)
    others = [name for name, found in COMMANDS.items() if found.module and word in flags_of(options_of(name))]
    others = others if word.startswith("--") else []
    belongs = f", but of palpate {', '.join(others)}" if others else ""
    if word == "--seeds":
        belongs += "; palpate study compares policies over several seeds"
    hint = f"; did you mean {near[0]}?" if near else "" if others else "; see --help"
    if not word.startswith("-"):
        return UsageError(f"palpate {command} takes no further argument {word}; options begin with --")
    return UsageError(f"{word} is not an option of palpate {command}{belongs}{hint}")
