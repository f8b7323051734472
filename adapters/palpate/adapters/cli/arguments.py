"""How flags, TOML files and presets come together, and how one line says what is wrong with them.

Light to import: nothing here loads the simulator, so that ``--help`` and wrong words are answered at once.
"""

import contextlib
import difflib
import io
import itertools
import os
import re
import shutil
import sys
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import is_dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final, TypeVar, cast, get_args, get_origin

import tyro
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

from palpate.adapters.cli.commands import COMMANDS, options_of
from palpate.adapters.config import (
    INSERTION,
    JOB,
    LEARNERS,
    OF_SOME,
    RigFile,
    RunConfig,
    compose,
    learner_in,
    read_job,
    read_toml,
    run_facts,
    with_options,
)
from palpate.core.errors import ConfigurationError, UsageError
from palpate.core.ports import kinds_of, table_beside

T = TypeVar("T")


def parse(kind: type[T], command: str, arguments: Sequence[str]) -> T:
    """Return the options on a command line, over those of ``--config``, over the job and the presets."""
    flags = flags_of(kind)
    if "--task.name" in flags:
        arguments = [re.sub(r"^--task(?==|$)", "--task.name", word) for word in arguments]
    _require_once(arguments, flags)
    if command == "run":
        _require_no_learning(arguments)
    default: Any = None
    composed: Composed | None = None
    if "run" in kind.__dataclass_fields__:  # type: ignore[attr-defined]
        facts, composed = _stated(arguments)
        # A run.toml also holds how many trials the same command ran, and with which policy.
        begun = facts if facts.get("command") == command else {}
        known = {name: _frozen(begun[name]) for name in ("trials", "policy") if name in begun}
        run = composed({})
        # Of options with values the parser would make a flag each; the flags' options are merged with those later.
        default = kind(run=replace(run, task=replace(run.task, options={})), **known)  # type: ignore[call-arg]
    output = io.StringIO()
    try:
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
            parsed, unknown = tyro.cli(
                kind,
                prog=f"palpate {command}",
                args=list(arguments),
                default=default,
                return_unknown_args=True,
                registry=readers(_untouched(arguments) if default is not None else ()),
                # Help texts are docstrings; looking for them in comments would take longer than all the rest.
                config=(tyro.conf.HelptextFromCommentsOff,),
            )
    except SystemExit as end:
        if not end.code:
            sys.stdout.write(_reflowed(output.getvalue()))
            raise
        raise UsageError(_one_line(output.getvalue())) from None
    if unknown:
        raise UsageError(f"{unknown[0]} is not an option of palpate {command}{_suggestion(flags, unknown[0])}")
    options: Any = parsed
    if composed is None:
        return cast("T", options)
    completed: T = replace(options, run=with_options(composed(_given(options.run, flags, arguments))))
    return completed


def _given(parsed: RunConfig, flags: Mapping[str, bool], arguments: Sequence[str]) -> dict[str, Any]:
    """Return the settings that flags name, as nested tables."""
    tables: dict[str, Any] = {}
    for word in arguments:
        flag = word.partition("=")[0].replace("_", "-")
        if flag not in flags:
            continue
        *path, last = re.sub(r"([-.])no-(?=[^.]*$)", r"\1", flag).removeprefix("--").replace("-", "_").split(".")
        found: Any = parsed
        table = tables
        for part in path:
            name = _declared(found, part)
            found, table = getattr(found, name, None), table.setdefault(name, {})
        if name := _declared(found, last):
            table[name] = getattr(found, name)
    return tables


def _declared(table: Any, flag: str) -> str:
    """Return the name of a field as it is declared, for flags in lower case; empty where there is none."""
    names = kinds_of(type(table)) if is_dataclass(table) else ()
    return next((name for name in names if name.lower() == flag.lower()), "")


def readers(untouched: Sequence[object]) -> ConstructorRegistry:
    """Return what the parser takes for one word: what may be a name or a table, and tables that stay as they are."""
    readers = ConstructorRegistry()

    @readers.primitive_rule
    def one_word(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[object] | None:
        if table_beside(info.type) is None and not any(info.type is one for one in untouched):
            return None
        return PrimitiveConstructorSpec(1, "STR", lambda words: words[0], lambda _: True, lambda value: [str(value)])

    return readers


def _untouched(arguments: Sequence[str]) -> list[object]:
    """Tables of a run's settings that no word names: to take them apart is most of the parser's work."""
    words = [word.replace("_", "-") for word in arguments]
    if any(word in ("-h", "--help") for word in words):
        return []
    return [
        table
        for name, table in kinds_of(RunConfig).items()
        if is_dataclass(table) and not any(word.startswith(f"--{name.replace('_', '-')}") for word in words)
    ]


_EARNED: Final = ("--learning.reinforcement", "--learning.effort-per-n-s")
"""What an action earns is in the tables of a run that does not learn, too."""


def _require_no_learning(arguments: Sequence[str]) -> None:
    """Refuse what a policy that does not learn would ignore."""
    for word in arguments:
        name = word.partition("=")[0]
        if name.startswith("--learning.") and name.replace("_", "-").lower() not in _EARNED:
            raise UsageError(f"{name} changes nothing: palpate run does not learn; palpate train --policy FILE does")


def _frozen(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


Composed = Callable[[Mapping[str, Any]], RunConfig]
"""Gives the configuration with the settings of flags, as nested tables."""


def _stated(arguments: Sequence[str]) -> tuple[dict[str, Any], Composed]:
    """Return what a run.toml says of its run, and the configuration of files, presets and rig, to be completed."""
    table: dict[str, Any] = {}
    facts: dict[str, Any] = {}
    path = _value_of("--config", arguments) or _resumed_run(arguments)
    if path:
        table = read_toml(Path(path))
        facts = run_facts(table, path)
    learned = "belief" if _value_of("--from-logs", arguments) else _learner_of_policies(arguments)
    learner = _preset("learner", learned or "q-learning", arguments, table, path)
    _require_of_learner(learner, arguments, {} if facts else table.get("learning", {}))
    rig = RigFile.load(Path(file)) if (file := _value_of("--rig", arguments)) else None
    job_file = _value_of("--job", arguments) or ("" if rig is None or path else rig.job)
    job = read_job(job_file) if job_file else None
    name = _preset("scenario", "paper" if job is None else JOB, arguments, table, path)
    if rig is not None:
        table, job = _on_rig(rig, table, job, arguments)
    task, sensor = _task(arguments, table, path), None if rig is None else rig.facts.noise()

    def composed(given: Mapping[str, Any]) -> RunConfig:
        return compose(name, learner, table, given, task=task, job=job, sensor=sensor)

    return facts, composed


def _on_rig(
    rig: RigFile, table: Mapping[str, Any], job: Mapping[str, Any] | None, arguments: Sequence[str]
) -> tuple[dict[str, Any], dict[str, Any] | None]:
    """Return settings and job without a simulated cell, and with the rig's arm and what was measured on it."""
    for word in arguments:
        if word.startswith("--cell."):
            flag = word.partition("=")[0]
            raise UsageError(f"{flag} sets up the simulated cell; with --rig, the rig says what is true of it")
    for tables, file in ((table, _value_of("--config", arguments)), (job or {}, _value_of("--job", arguments))):
        if "cell" in tables and file:
            sys.stderr.write(f"palpate: [cell] of {file} is ignored: the rig says what is true of it\n")
    return rig.laid_over(table, job, _value_of("--arm", arguments), measured="--resume" not in arguments)


def _preset(kind: str, usual: str, arguments: Sequence[str], table: Mapping[str, Any], path: str) -> str:
    """Name of the scenario, or of the learner."""
    named, written = _value_of(f"--{kind}", arguments), table.get(kind)
    if named and written is not None and named != written:
        # The file's settings would win over the other preset's and leave it in name only.
        raise ConfigurationError(kind, named, f"{written!r}, as in {path}, or a file that names no {kind}")
    name = named or (usual if written is None else written)
    if not isinstance(name, str):
        raise ConfigurationError(kind, name, "a name")
    return name


def _task(arguments: Sequence[str], table: Mapping[str, Any], path: str) -> str:
    """Name of the task: its own preset stands below the file and the flags, as the scenario's does."""
    inner = table.get("task")
    return _preset(
        "task.name", INSERTION, arguments, {"task.name": inner.get("name")} if isinstance(inner, dict) else {}, path
    )


def _learner_of_policies(arguments: Sequence[str]) -> str:
    """Return the learner of all policy files after ``--policy``; empty where they do not agree."""
    files: list[str] = []
    for i, word in enumerate(arguments):
        if word.startswith("--policy="):
            files.append(word.partition("=")[2])
        elif word == "--policy":
            files += itertools.takewhile(lambda one: not one.startswith("-"), arguments[i + 1 :])
    found = {learner_in(file) for file in files}
    return found.pop() if len(found) == 1 else ""


def _require_of_learner(learner: str, arguments: Sequence[str], learning: Any) -> None:
    """Refuse what the learner would ignore, on the command line and in a person's file."""
    flags = (word.partition("=")[0].replace("-", "_") for word in arguments if word.startswith("--learning."))
    given = [*(flag.removeprefix("__learning.").partition(".")[0] for flag in flags), *learning]
    for name in given:
        has = next((has for setting, has in OF_SOME.items() if setting.lower() == name.lower()), LEARNERS)
        if learner in LEARNERS and learner not in has:
            raise ConfigurationError("learner", learner, f"{' or '.join(has)}, which learning.{name} is of")


def _resumed_run(arguments: Sequence[str]) -> str:
    """With ``--resume``, the settings that the run in ``--out`` began with."""
    if "--resume" not in arguments:
        return ""
    folder = _value_of("--out", arguments) or f"runs/{_value_of('--scenario', arguments) or 'paper'}"
    path = Path(folder) / "run.toml"
    # Not Path.exists, which raises where it may not look.
    return str(path) if os.path.exists(path) else ""


def _value_of(flag: str, arguments: Sequence[str]) -> str:
    value = ""
    for i, word in enumerate(arguments):
        if word == flag and i + 1 < len(arguments):
            value = arguments[i + 1]
        elif word.startswith(flag + "="):
            value = word.split("=", 1)[1]
    return value


_HELP_COLUMN: Final = 8
"""Help texts begin here, or farther to the right."""


def _reflowed(text: str) -> str:
    """Help as wide as the terminal: the parser keeps the line ends of docstrings, and breaks their lines once more."""
    paragraphs: list[tuple[int, str]] = []
    for line in map(str.rstrip, text.splitlines()):
        begins = len(line) - len(line.lstrip())
        if line and begins >= _HELP_COLUMN and begins == paragraphs[-1][0]:
            paragraphs[-1] = begins, f"{paragraphs[-1][1]} {line.lstrip()}"
        else:
            flag = re.match(r"  (?:-|STR|\[\[STR).*?\s{2,}(?=\S)", line)
            paragraphs.append((flag.end() if flag else begins, line))
    wide = shutil.get_terminal_size().columns
    lines = [
        textwrap.fill(line, wide, subsequent_indent=" " * column, break_long_words=False, break_on_hyphens=False)
        if column == 0 or column >= _HELP_COLUMN
        else line
        for column, line in paragraphs
    ]
    return "\n".join((*lines, ""))


def _one_line(boxed: str) -> str:
    """The message in the parser's box, without the box, its title and its hints."""
    flat = " ".join(re.sub(r"[╭╮╰╯│]", " ", boxed).split())
    parts = [part.strip(" ─-") for part in re.split(r"[─-]{5,}", flat)]
    message = next((part for part in parts if part.startswith("Error parsing")), "") or max(parts, key=len, default="")
    refused = re.search(r"Error parsing [^:]*: (\S+ = .* is refused: .*)$", message)
    return refused.group(1) if refused else message


def flags_of(kind: type) -> dict[str, bool]:
    """Every flag of a command; True for those that may be given several times."""
    found: dict[str, bool] = {}
    for path, marks, base in _walk(kind, ()):
        if tyro.conf.Positional not in marks:
            *outer, last = (part.replace("_", "-") for part in path)
            for name in (last, f"no-{last}") if base is bool else (last,):
                found["--" + ".".join((*outer, name))] = tyro.conf.UseAppendAction in marks
    return found


def _walk(kind: type, outer: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], tuple[Any, ...], Any]]:
    for name, annotation in kinds_of(kind).items():
        base, *marks = get_args(annotation) if get_origin(annotation) is Annotated else (annotation,)
        if isinstance(base, type) and is_dataclass(base):
            flat = any(getattr(mark, "name", None) == "" for mark in marks)
            yield from _walk(base, outer if flat else (*outer, name))
        else:
            yield (*outer, name), tuple(marks), base


def _require_once(arguments: Sequence[str], flags: Mapping[str, bool]) -> None:
    """Refuse a setting that is given twice: the parser would take the last one without a word."""
    given: dict[str, str] = {}
    for i, word in enumerate(arguments):
        flag, equals, value = word.partition("=")
        flag = flag.replace("_", "-")
        if flags.get(flag) is not False:
            continue
        if not equals:
            value = arguments[i + 1] if i + 1 < len(arguments) and not arguments[i + 1].startswith("--") else ""
        # --no-x is the other value of --x.
        setting = re.sub(r"([-.])no-(?=[^.]*$)", r"\1", flag) if flag.replace("no-", "", 1) in flags else flag
        written = f"{flag} {value}".strip()
        if setting in given:
            raise UsageError(f"{setting} is given twice: {given[setting]} and {written}; give it once")
        given[setting] = written


def _suggestion(flags: Iterable[str], word: str) -> str:
    word = word.split("=", 1)[0].replace("_", "-")
    near = difflib.get_close_matches(word, flags, n=1, cutoff=0.6)
    places = {name: command.options for name, command in COMMANDS.items() if command.options}
    others = [name for name, place in places.items() if word in flags_of(options_of(place))] if word[:2] == "--" else []
    if others:
        return f", but of palpate {', '.join(others)}" + (f"; did you mean {near[0]}?" if near else "")
    return f"; did you mean {near[0]}?" if near else "; see --help"
