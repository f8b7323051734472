"""Command-line options of ``palpate infer`` and ``palpate automaton``."""

from dataclasses import dataclass, field
from typing import Annotated

import tyro

from palpate.core.automata import InferenceSettings
from palpate.core.ports import Settings

Flat = Annotated[InferenceSettings, tyro.conf.arg(name="")]
Words = Annotated[tuple[str, ...], tyro.conf.Positional]
Word = Annotated[str, tyro.conf.Positional]


@dataclass(frozen=True)
class InferOptions(Settings):
    """Infer an automaton from symbol strings, with an Elman network and dynamic state partitioning.

    Strings are a text file with one string a line (palpate explore --strings writes such), or logs of insertion trials,
    or folders with logs: there, each trial that ended in the hole is a string. Strings with labels give an acceptor,
    others a machine that says what may come next, and strings of actions and symbols one that does so for each action.
    """

    files: Words = ()
    """A text file; or logs, and folders with logs."""
    out: str = ""
    """Folder for automaton, network, report and pictures; it must not be there yet, or be empty."""
    with_actions: bool = False
    """Of logs: pairs of an action and the symbol it led to; trials that did not end in the hole count too."""
    settings: Flat = field(default_factory=InferenceSettings)


@dataclass(frozen=True)
class ShowAutomatonOptions(Settings):
    """Print an automaton; or write it as DOT, or draw it."""

    file: Word
    """The automaton, a JSON file."""
    out: str = ""
    """Write it here instead, by the ending: .dot, .svg, .png or .json; a file that is not there yet."""


@dataclass(frozen=True)
class CompareAutomataOptions(Settings):
    """Do two automata answer every word alike? Exit code 0 if they do; 1, and the shortest word that tells, if not."""

    one: Word
    """An automaton, a JSON file."""
    other: Word
    """Another one of the same kind over the same symbols."""


@dataclass(frozen=True)
class MinimiseOptions(Settings):
    """Write the smallest automaton that answers every word alike."""

    file: Word
    """The automaton, a JSON file."""
    out: str = ""
    """Where: .json, .dot, .svg or .png, a file that is not there yet; beside it as NAME.minimal.json if not given."""
