"""Command-line options of each subcommand, and how flags, TOML files and presets come together.

Light to import: nothing here loads the simulator, so that ``--help`` and wrong words are answered at once.
"""

from __future__ import annotations

import contextlib
import difflib
import io
import os
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final, TypeAlias, TypeVar, get_args, get_origin

import tyro
from typing_extensions import override

from palpate.adapters.cli.commands import COMMANDS, options_of
from palpate.adapters.config import RENAMED, RunConfig, now_called, overlay, read_toml, recorded, scenario
from palpate.core.errors import ConfigurationError, UsageError
from palpate.core.ports import OneOf, Range, Settings, kinds_of

T = TypeVar("T")
Flat = Annotated[RunConfig, tyro.conf.arg(name="")]
Trials: TypeAlias = Annotated[int, Range(1, 1_000_000)]
Jobs: TypeAlias = Annotated[int, Range(0, 1024)]


@dataclass(frozen=True)
class RunSettings(Settings):
    """What every command takes that runs trials."""

    run: Flat = field(default_factory=RunConfig)
    config: str = ""
    """TOML file with any of the settings below (a run.toml too); flags win over it."""


@dataclass(frozen=True)
class TrainOptions(RunSettings):
    """Learn an insertion from scratch by Q-learning, and leave a folder with everything about it."""

    trials: Trials = 350
    """Number of trials."""
    out: str = ""
    """Folder for the results; runs/SCENARIO if not given. It must not hold a run already."""
    policy: str = "q-learning"
    """q-learning, or a policy file to go on learning from (its Q values; exploration begins anew)."""
    rig: str = ""
    """Rig file: train on its devices instead of in the simulator."""
    resume: bool = False
    """Go on with the run in --out where it stopped, with its settings and the same random streams."""


@dataclass(frozen=True)
class RunOptions(RunSettings):
    """Run a trained policy, or a comparator, without learning."""

    policy: str = ""
    """A policy file, or omniscient, torque, spiral-10, spiral-5, random."""
    trials: Trials = 50
    """Number of trials."""
    rig: str = ""
    """Rig file: run on its devices instead of in the simulator."""
    out: str = ""
    """Folder for the results; runs/SCENARIO-run-001 or the next number if not given. It must not hold a run yet."""


@dataclass(frozen=True)
class CompareOptions(RunSettings):
    """Compare hand-written strategies, and trained policies beside them, on the same trials."""

    policy: tuple[str, ...] = ()
    """Policy files to put beside the comparators."""
    trials: Trials = 50
    """Trials of each."""
    out: str = ""
    """Folder for the table; runs/SCENARIO-compare if not given. It must not hold a run already."""


@dataclass(frozen=True)
class ShowOptions(Settings):
    """Print what a policy file knows: states, best actions, values, visits."""

    file: Annotated[str, tyro.conf.Positional]
    """The policy file."""


@dataclass(frozen=True)
class ReplayOptions(Settings):
    """Feed recorded trials back through the core and compare every command and decision, bit by bit.

    Exit code 0: all equal; 1: something differs; 2: a log or an option cannot be used. With --policy, --set or --config
    it is a what-if: 1 then says that the trial would have gone otherwise, and all that follows the first other command
    is marked counterfactual.
    """

    logs: Annotated[tuple[str, ...], tyro.conf.Positional] = ()
    """Logs, folders with logs in or below them, or patterns in quotes."""
    policy: str = ""
    """What if: another policy; a policy file, or omniscient, torque, spiral-10, spiral-5, random."""
    set: Annotated[tuple[str, ...], tyro.conf.UseAppendAction] = ()
    """What if: a setting, as in --set task.max_force_N=20; may be given several times."""
    config: str = ""
    """What if: the settings of this TOML file (a run.toml too) instead of the log's."""
    continue_in_mujoco: bool = False
    """What if: let the simulator go on from the first other command (for logs that came from it)."""
    out: str = ""
    """Folder for the logs of a what-if; it must not be there yet."""
    strict: bool = False
    """Let a log from another processor fail when its last bits differ."""
    markdown: str = ""
    """Write what differs as a Markdown table to this file, for the review of a change."""
    jobs: Jobs = 0
    """Processes; 0 takes one per core."""
    verbose: bool = False
    """A line for every log, also where there are many."""


@dataclass(frozen=True)
class CheckAdapterOptions(Settings):
    """Try the contract of a port on an adapter of your own, clause by clause.

    Exit code 0: every clause that applies is kept; 1: one is broken; 2: the name leads to nothing that can be tried.
    """

    adapter: Annotated[str, tyro.conf.Positional]
    """package.module:Name - a contract suite, a function that makes a rig, or a force sensor or clock."""
    moves: bool = False
    """Send commands to the arm, along ramps within the next two; what will move is printed first."""
    rate_rad_s: Annotated[float, Range(0.0, 10.0)] = 0.0
    """With --moves: highest rate of a joint, rad/s."""
    reach_rad: Annotated[float, Range(0.0, 7.0)] = 0.0
    """With --moves: farthest that a joint may go from the rig's home_rad, rad."""

    @override
    def check(self) -> None:
        for name in ("rate_rad_s", "reach_rad"):
            if self.moves and not getattr(self, name):
                accepted = "more than 0: with --moves you say how fast and how far joints may move"
                raise ConfigurationError(name, getattr(self, name), accepted)
            if not self.moves and getattr(self, name):
                raise ConfigurationError(name, getattr(self, name), "given with --moves only")


@dataclass(frozen=True)
class DoctorOptions(Settings):
    """Open each device of a rig, measure how it does, and say how to mend what is wrong.

    Nothing moves and no servo is switched on, except with --move. End other programs that use the devices first.

    Exit code 0: all well; 1: something is wrong, each with a line "-> remedy"; 2: the rig file or an option cannot be
    used.
    """

    rig: str = ""
    """Rig file: names the devices."""
    seconds: Annotated[float, Range(0.2, 600.0)] = 3.0
    """How long to measure at each device."""
    push: bool = False
    """Ask somebody to push the tool, or to hang a weight on it, and check the signs of the wrench."""
    move: bool = False
    """Switch the arm on, move its last joint by 0.001 rad and back, and check that it follows."""
    json: bool = False
    """Print one JSON object instead of text."""
    arm: str = "zebra-zero"
    """Kinematic model of the arm: zebra-zero or ur5."""


@dataclass(frozen=True)
class EmulateOptions(Settings):
    """Serve the simulated work cell behind emulated wires, until Ctrl-C.

    MuJoCo moves the arm; pseudo-terminals lead to its devices.

    Prints a rig file; `palpate run --rig FILE` then drives the cell as it would drive the devices themselves.
    """

    arm: str = "zebra-nmc"
    """Arm: zebra-nmc (the Zebra Zero's own serial bus) or cia402 (a refit with CAN drives)."""
    force: str = "jr3-can"
    """Force sensor: jr3-can or jr3-uart."""
    rig_file: str = ""
    """Write the rig file here; it must not be there yet."""
    scenario: str = "paper"
    """Scenario of the simulated cell: paper or blind."""
    seed: int = 0
    """Its seed: gives hole and sensor errors."""
    baud: int = 230400
    """Line rate of the arm's serial bus."""
    divider: int = 2
    """Control ticks per bus cycle: 2 is 70 Hz."""
    wrist_backlash_deg: float = 0.0
    """Full gap of the wrist's gears."""
    usb_latency_ms: float = 0.0
    """Latency timer of an emulated USB adapter on the serial lines; 16 is usual, 1 a good setting."""
    priority: Annotated[int, Range(0, 99)] = 0
    """Real-time priority (SCHED_FIFO) of the emulated devices, 1 to 99: other work on this machine then does not hold
    them up, which real devices would not know either. 0 asks for none; a refusal is told."""


@dataclass(frozen=True)
class FaultsOptions(RunSettings):
    """Trials in which every kind of fault strikes in every phase, and a table of what came of it.

    Exit code 0: every fault was tolerable, or stopped in time with a readable log; 1: one was not, or a peg was said to
    be inserted that was not.
    """

    seeds: Annotated[int, Range(1, 100_000)] = 1
    """Seeds; each gives every fault in every phase, at a tick of its own."""
    rig: str = ""
    """Rig file: run on its devices in real time instead of in the simulator."""
    most: Annotated[int, Range(0, 10_000_000)] = 0
    """Make only so many of the runs, spread evenly; 0 makes all."""
    group: Annotated[str, OneOf("all", "devices", "liars")] = "all"
    """devices: those that fail openly; liars: sensors whose every sample could be true."""
    phase: Annotated[str, OneOf("", "lift", "transfer", "settle", "approach", "explore", "insert")] = ""
    """Strike in this phase only; lift is the first tick, for liars."""
    fault: str = ""
    """Only faults with this in their name."""
    by_phase: bool = False
    """Print a line for each phase of each fault."""
    supervisor: bool = True
    """Whether the supervisor stands between the task and the arm; without it the campaign should fail."""
    out: str = ""
    """CSV file with a line for every run; it must not be there yet."""
    jobs: Jobs = 0
    """Processes in the simulator; 0 takes one per core."""


def parse(kind: type[T], command: str, arguments: Sequence[str]) -> T:
    """The options on a command line, over those of ``--config``, over those of the scenario.

    Raises:
        ConfigurationError: Something on the command line or in the file cannot be used; one line says what.
    """
    flags = _flags(kind)
    _require_once(arguments, flags)
    if command == "run":
        _require_no_learning(arguments)
    default: Any = None
    cell_in_file = False
    if "run" in kind.__dataclass_fields__:  # type: ignore[attr-defined]
        config, facts, cell_in_file = _base(arguments)
        # A run.toml also holds how many trials the same command ran, and with which policy.
        begun = facts if facts.get("command") == command else {}
        known = {name: _frozen(begun[name]) for name in ("trials", "policy") if name in begun}
        default = kind(run=config, **known)  # type: ignore[call-arg]
    output = io.StringIO()
    try:
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
            parsed, unknown = tyro.cli(
                kind,
                prog=f"palpate {command}",
                args=list(arguments),
                default=default,
                return_unknown_args=True,
                # Help texts are docstrings; looking for them in comments would take longer than all the rest.
                config=(tyro.conf.HelptextFromCommentsOff,),
            )
    except SystemExit as end:
        if not end.code:
            sys.stdout.write(output.getvalue())
            raise
        raise UsageError(_one_line(output.getvalue())) from None
    if unknown:
        raise UsageError(f"{unknown[0]} is not an option of palpate {command}{_suggestion(flags, unknown[0])}")
    result: T = parsed
    return _on_rig(result, arguments, cell_in_file) if getattr(result, "rig", "") and default is not None else result


_EARNED: Final = ("--learning.reinforcement", "--learning.effort-per-n-s")
"""What an action earns is in the tables of a run that does not learn, too."""


def _require_no_learning(arguments: Sequence[str]) -> None:
    """Refuse what a policy that does not learn would ignore.

    Raises:
        UsageError: A flag would set how to learn.
    """
    for word in arguments:
        name = word.partition("=")[0]
        if name.startswith("--learning.") and name.replace("_", "-").lower() not in _EARNED:
            raise UsageError(f"{name} changes nothing: palpate run does not learn; palpate train --policy FILE does")


def _on_rig(options: Any, arguments: Sequence[str], cell_in_file: bool) -> Any:
    """The options with nothing of the simulated cell's in them: what is true of a real rig is said by the rig.

    Raises:
        UsageError: A flag would set up the cell.
    """
    for word in arguments:
        if word.startswith("--cell."):
            flag = word.partition("=")[0]
            raise UsageError(f"{flag} sets up the simulated cell; beside --rig, the rig says what is true of it")
    if not cell_in_file or "--resume" in arguments:
        return options
    sys.stderr.write(
        f"palpate: [cell] of {_value_of('--config', arguments)} is ignored: the rig says what is true of it\n"
    )
    return replace(options, run=replace(options.run, cell=scenario(options.run.scenario).cell))


def _frozen(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _base(arguments: Sequence[str]) -> tuple[RunConfig, dict[str, Any], bool]:
    """What the flags start from: the scenario, named on the command line or in the file, and the file over it.

    Returns:
        The configuration, the table ``[run]`` of the file, and whether the file sets up the simulated cell.
    """
    table: dict[str, Any] = {}
    facts: dict[str, Any] = {}
    path = _value_of("--config", arguments) or _resumed_run(arguments)
    if path:
        table = read_toml(Path(path))
        if "run" in table:
            facts = table.pop("run")
            table = recorded(table)
    named, written = _value_of("--scenario", arguments), table.get("scenario")
    if named and written is not None and named != written:
        # The file's settings would win over the other scenario's and leave it in name only.
        raise ConfigurationError("scenario", named, f"{written!r}, as in {path}, or a file that names no scenario")
    name = named or ("paper" if written is None else written)
    if not isinstance(name, str):
        raise ConfigurationError("scenario", name, "a name")
    config = overlay(scenario(name), {**table, "scenario": name})
    return config, facts if isinstance(facts, dict) else {}, "cell" in table


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


def _one_line(boxed: str) -> str:
    """The message in the parser's box, without the box, its title and its hints."""
    flat = " ".join(re.sub(r"[╭╮╰╯│]", " ", boxed).split())
    parts = [part.strip(" ─-") for part in re.split(r"[─-]{5,}", flat)]
    message = next((part for part in parts if part.startswith("Error parsing")), "") or max(parts, key=len, default="")
    refused = re.search(r"Error parsing [^:]*: (\S+ = .* is refused: .*)$", message)
    return refused.group(1) if refused else message


def _flags(kind: type) -> dict[str, bool]:
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
    old = {f"--{name.replace('_', '-')}": name for name in RENAMED}
    if word in old:
        return f"; it is called {now_called(old[word])} now"
    near = difflib.get_close_matches(word, flags, n=1, cutoff=0.6)
    places = {name: command.options for name, command in COMMANDS.items() if command.options}
    others = [name for name, place in places.items() if word in _flags(options_of(place))] if word[:2] == "--" else []
    if others:
        return f", but of palpate {', '.join(others)}" + (f"; did you mean {near[0]}?" if near else "")
    return f"; did you mean {near[0]}?" if near else "; see --help"
