"""Commands and their modules, imported only on use so that ``palpate --help`` loads no settings library."""

from collections.abc import Callable
from importlib import import_module

# Importing even dataclasses and typing would take longer than the rest of ``palpate --help``.


class Command:
    """A command with its summary and the modules that contain its function and options. A group has only a summary."""

    def __init__(self, text: str, module: str = "", options: str = "options") -> None:
        self.text, self.module, self.options = text, module, options


COMMANDS: dict[str, Command] = {
    "train": Command("train a policy; save policy, trials and learning curve", "train"),
    "run": Command("run a trained policy, or a baseline, without learning", "run"),
    "compare": Command("compare hand-written strategies and trained policies on the same trials", "compare"),
    "study": Command("run every combination of settings, policies and seeds of a file", "study"),
    "plan": Command("judge a job before anything moves: derived settings, regime, verdict; simulate it", "plan"),
    "show": Command("print the contents of a policy file", "show", "show"),
    "explore": Command("learn in a grid world with an ambiguous sensor, and compare with the optimum", "explore"),
    "infer": Command(
        "infer an automaton from symbol strings or recorded trials; show or compare automata", "infer", "infer"
    ),
    "replay": Command("feed recorded trials back through the core; every command and decision must be equal", "replay"),
    "report": Command("create an HTML page about a run or a study, with plots", "report", "report"),
    "log": Command("look at recorded trials: info, plot, score, export, import"),
    "render": Command("make a video of a recorded trial", "render", "render"),
    "emulate": Command("serve the simulated cell through emulated serial, CAN and network devices", "emulate"),
    "rig": Command("commission a rig: doctor, calibrate, check, new"),
    "settings": Command("print every setting of a group: type, range, unit, default, help", "settings", "settings"),
    "rig doctor": Command("examine the devices of a rig and print remedies for problems", "rig_doctor"),
    "rig calibrate": Command(
        "measure the parameters of a new rig step by step, and write them to the rig file", "rig_calibrate"
    ),
    "rig check": Command("test your own adapter against the contract of its port", "rig_check"),
    "rig new": Command("print a rig file for an arm and a force sensor", "rig_new", "rig_new"),
    "log info": Command("summarise logs: configuration, timing, completeness, outcome", "log", "log"),
    "log plot": Command("plot one trial over time", "log", "log"),
    "log score": Command("score trials by a public score sheet", "log", "log"),
    "log export": Command("export logs as CSV files or ROS 2 bags", "log", "log"),
    "log import": Command("convert a ROS 2 bag to a log", "log", "log"),
}

GROUPS: dict[str, tuple[str, str]] = {
    "log": ("Look at recorded trials.", "Logs are the .mcap files in the folder logs of a run."),
    "rig": ("Commission a rig of real or emulated devices.", "To begin: palpate rig doctor --rig FILE"),
}
"""Command groups, each with its purpose and a note."""


def commands_of(group: str = "") -> dict[str, Command]:
    """Return all ``palpate`` commands, or those in a group."""
    begin = f"{group} " if group else ""
    names = {name.removeprefix(begin): command for name, command in COMMANDS.items() if name.startswith(begin)}
    return {name: command for name, command in names.items() if " " not in name}


def help_of(group: str = "") -> str:
    """Return the help text for ``palpate``, or for a group of commands."""
    about, more = GROUPS.get(group, ("A robot arm learns contact tasks by touch.", "To begin: palpate train"))
    called, width = f"palpate {group}".rstrip(), 9
    commands = "".join(f"  {name:<{width}}  {command.text}\n" for name, command in commands_of(group).items())
    more = f"{called} COMMAND --help lists the options of each; --debug prints the traceback of an error. {more}"
    return f"usage: {called} COMMAND [OPTIONS]\n\n{about}\n\ncommands:\n{commands}\n{more}\n"


def function_of(name: str) -> Callable[..., object]:
    """Return the function that runs a command; it is named after the command's last word."""
    word, module = name.split()[-1], import_module(f"palpate.adapters.cli.{COMMANDS[name].module}")
    found: Callable[..., object] = getattr(module, "import_" if word == "import" else word)
    return found


def options_of(name: str) -> type:
    """Return a command's options class."""
    module = import_module(f"palpate.adapters.cli.{COMMANDS[name].options}")
    found: type = getattr(module, f"{name.split()[-1].title()}Options")
    return found
