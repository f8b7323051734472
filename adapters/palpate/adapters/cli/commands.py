"""The commands, and where each is. Nothing is imported before it runs: ``palpate --help`` loads no settings library."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

# Not even dataclasses and typing: importing them would take longer than all that ``palpate --help`` does.


class Command:
    """One command.

    Args:
        text: What it does, in a line.
        function: ``module:function`` that runs it, in this room.
        options: ``module:Class`` of its options; empty where it looks at its words itself.
    """

    def __init__(self, text: str, function: str, options: str = "") -> None:
        self.text, self.function, self.options = text, function, options


COMMANDS: dict[str, Command] = {
    "train": Command(
        "learn an insertion by trial; leaves a folder with policy, trials and learning curve",
        "train:train", "options:TrainOptions",
    ),
    "run": Command("run a trained policy, or a comparator, without learning", "run:run", "options:RunOptions"),
    "compare": Command(
        "table of hand-written strategies and trained policies on the same trials",
        "compare:compare", "options:CompareOptions",
    ),
    "study": Command(
        "many runs: settings, policies and seeds from one file, on several processes or a Dask cluster",
        "study:study", "study_options:StudyOptions",
    ),
    "show": Command("print what a policy file knows", "show:show", "options:ShowOptions"),
    "explore": Command(
        "learn in a grid world with an ambiguous sensor, and hold it against the optimum",
        "explore:explore", "explore_options:ExploreOptions",
    ),
    "infer": Command(
        "an automaton from symbol strings, or from what recorded trials felt",
        "infer:infer_command", "automaton_options:InferOptions",
    ),
    "automaton": Command("show, compare or minimise automata", "automaton:automaton"),
    "replay": Command(
        "feed recorded trials back through the core; every command and decision must be equal",
        "replay:replay", "options:ReplayOptions",
    ),
    "report": Command("one page about a run or a study, with its pictures, to be read in a browser", "report:report"),
    "log": Command("look at recorded trials: info, plot, export, recover", "log:log"),
    "render": Command("a film or a picture of a recorded trial", "render:render", "picture_options:RenderOptions"),
    "view": Command("watch trials in the simulator, in real time", "view:view", "picture_options:ViewOptions"),
    "check-adapter": Command(
        "try the contract of a port on an adapter of your own",
        "check_adapter:check_adapter", "options:CheckAdapterOptions",
    ),
    "emulate": Command(
        "serve the simulated cell behind emulated serial and CAN wires", "emulate:emulate", "options:EmulateOptions"
    ),
    "doctor": Command(
        "examine the devices of a rig, and say how to mend what is wrong", "doctor:doctor", "options:DoctorOptions"
    ),
    "faults": Command(
        "trials in which something goes wrong on purpose, and what came of each",
        "faults:faults", "options:FaultsOptions",
    ),
    "version": Command("versions of palpate and of what its results depend on", "version:version"),
}  # fmt: skip

OPTIONS_OF_PARTS: dict[str, str] = {
    "log info": "log_options:InfoOptions",
    "log plot": "log_options:PlotOptions",
    "log export": "log_options:ExportOptions",
    "log recover": "log_options:RecoverOptions",
    "automaton show": "automaton_options:ShowAutomatonOptions",
    "automaton compare": "automaton_options:CompareAutomataOptions",
    "automaton minimise": "automaton_options:MinimiseOptions",
}
"""The same of commands of commands."""

HELP = (
    "usage: palpate COMMAND [OPTIONS]\n\n"
    "A robot arm learns contact tasks by touch.\n\ncommands:\n"
    + "".join(f"  {name:<13}  {command.text}\n" for name, command in COMMANDS.items())
    + "\npalpate COMMAND --help tells the options of each. To begin: palpate train\n"
)


def loaded(place: str) -> Callable[..., object]:
    """The function or class that ``module:name`` of this room leads to."""
    module, _, name = place.partition(":")
    found: Callable[..., object] = getattr(import_module(f"palpate.adapters.cli.{module}"), name)
    return found


def options_of(place: str) -> type:
    """The class that ``module:Class`` of this room leads to."""
    found = loaded(place)
    if not isinstance(found, type):
        raise TypeError(f"{place} is no class of options")
    return found
