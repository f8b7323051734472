"""The commands and their modules, imported when a command runs: ``palpate --help`` loads no settings library."""

from collections.abc import Callable
from importlib import import_module

# Importing even dataclasses and typing would take longer than the rest of ``palpate --help``.


class Command:
    """One command: ``module:function`` that runs it, empty for a group, and ``module:Class`` of its options, if any."""

    def __init__(self, text: str, function: str = "", options: str = "") -> None:
        self.text, self.function, self.options = text, function, options


COMMANDS: dict[str, Command] = {
    "train": Command(
        "learn an insertion by trial; leaves a folder with policy, trials and learning curve",
        "train:train", "options:TrainOptions",
    ),
    "run": Command("run a trained policy, or a baseline, without learning", "run:run", "options:RunOptions"),
    "compare": Command(
        "table of hand-written strategies and trained policies on the same trials",
        "compare:compare", "options:CompareOptions",
    ),
    "study": Command(
        "many runs: settings, policies and seeds from one file, on several processes",
        "study:study", "options:StudyOptions",
    ),
    "plan": Command(
        "judge a job before anything moves: derived settings, regime, verdict; simulate it",
        "plan:plan", "options:PlanOptions",
    ),
    "show": Command("print what a policy file holds", "show:show", "show:ShowOptions"),
    "explore": Command(
        "learn in a grid world with an ambiguous sensor, and compare with the optimum",
        "explore:explore", "options:ExploreOptions",
    ),
    "infer": Command(
        "infer an automaton from symbol strings or recorded trials; show or compare automata",
        "infer:infer_command", "infer:InferOptions",
    ),
    "replay": Command(
        "feed recorded trials back through the core; every command and decision must be equal",
        "replay:replay", "options:ReplayOptions",
    ),
    "report": Command(
        "one page about a run or a study, with its pictures, to be read in a browser",
        "report:report", "report:ReportOptions",
    ),
    "log": Command("look at recorded trials: info, plot, score, export, import"),
    "render": Command("make a video of a recorded trial", "render:render", "render:RenderOptions"),
    "emulate": Command(
        "serve the simulated cell behind emulated serial and CAN wires", "emulate:emulate", "options:EmulateOptions"
    ),
    "rig": Command("commission a rig: doctor, calibrate, check, new"),
    "settings": Command(
        "print every setting of a group: type, range, unit, default, help", "settings:settings",
        "settings:SettingsOptions",
    ),
    "rig doctor": Command(
        "examine the devices of a rig, and say what to do about what is wrong",
        "rig_doctor:doctor", "options:DoctorOptions",
    ),
    "rig calibrate": Command(
        "measure what a new rig lacks, step by step, and write it into the rig file",
        "rig_calibrate:calibrate", "options:CalibrateOptions",
    ),
    "rig check": Command(
        "try the contract of a port on an adapter of your own", "rig_check:check", "options:CheckOptions"
    ),
    "rig new": Command("print a rig file for an arm and a force sensor", "rig_new:new", "rig_new:RigNewOptions"),
    "log info": Command(
        "summarise logs: configuration, timing, completeness, outcome", "log:info", "log:InfoOptions"
    ),
    "log plot": Command("a picture of one trial over time", "log:plot", "log:PlotOptions"),
    "log score": Command("points of trials by a public score sheet", "log:score", "log:ScoreOptions"),
    "log export": Command("the same data as CSV files or bags of ROS 2", "log:export", "log:ExportOptions"),
    "log import": Command("a bag of ROS 2 as a log", "log:import_bag", "log:ImportOptions"),
}  # fmt: skip

GROUPS: dict[str, tuple[str, str]] = {
    "log": ("Look at recorded trials.", "Logs are the .mcap files in the folder logs of a run."),
    "rig": ("Commission a rig of real or emulated devices.", "To begin: palpate rig doctor --rig FILE"),
}
"""Groups of commands, with their purpose and a further note."""


def commands_of(group: str = "") -> dict[str, Command]:
    """Return the commands of ``palpate``, or of a group."""
    begin = f"{group} " if group else ""
    names = {name.removeprefix(begin): command for name, command in COMMANDS.items() if name.startswith(begin)}
    return {name: command for name, command in names.items() if " " not in name}


def help_of(group: str = "") -> str:
    """Return the help text of ``palpate``, or of a group of commands."""
    about, more = GROUPS.get(group, ("A robot arm learns contact tasks by touch.", "To begin: palpate train"))
    called, width = f"palpate {group}".rstrip(), 9
    commands = "".join(f"  {name:<{width}}  {command.text}\n" for name, command in commands_of(group).items())
    more = f"{called} COMMAND --help lists the options of each; --debug prints the traceback of an error. {more}"
    return f"usage: {called} COMMAND [OPTIONS]\n\n{about}\n\ncommands:\n{commands}\n{more}\n"


def loaded(place: str) -> Callable[..., object]:
    """Return the function or class at ``module:name`` of this package."""
    module, _, name = place.partition(":")
    found: Callable[..., object] = getattr(import_module(f"palpate.adapters.cli.{module}"), name)
    return found


def options_of(place: str) -> type:
    """Return the class at ``module:Class`` of this package."""
    found = loaded(place)
    if not isinstance(found, type):
        raise TypeError(f"{place} is no class of options")
    return found
