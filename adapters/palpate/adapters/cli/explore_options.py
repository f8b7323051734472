"""Command-line options of ``palpate explore``."""

from dataclasses import dataclass, field
from typing import Annotated

import tyro

from palpate.adapters.cli.options import Trials
from palpate.adapters.config import TRIALS, GridLearning
from palpate.core.ports import Range, Settings

FlatGrid = Annotated[GridLearning, tyro.conf.arg(name="")]


@dataclass(frozen=True)
class ExploreOptions(Settings):
    """Learn to find the goal of a grid world with an ambiguous sensor, and see how near that comes to the optimum.

    Prints, for each run, the mean number of steps in its last 100 trials, and beside it what is possible at all: the
    optimum with full information and the belief-state optimum.
    """

    map: str = "1"
    """1, 2 or twin: the scenarios; eight regions such as ABC/C.E/BDF; or a text file with rows of letters, # for a
    wall and a dot for the goal."""
    size: int = 7
    """Length of a side in cells, odd; a text file has its own."""
    state: str = "symbols"
    """symbols: a state is a symbol; last-2, last-3: the last symbols; or an automaton file (.json)."""
    learning: FlatGrid = field(default_factory=GridLearning)
    trials: Trials = TRIALS
    """Trials of each run."""
    seeds: Annotated[int, Range(1, 100_000)] = 3
    """Number of independent runs."""
    seed: Annotated[int, Range(0, 2**32 - 1)] = 0
    """Seed of the first; the others follow."""
    out: str = ""
    """Folder for every trial, the policies, summary and learning curve; it must not be there yet, or be empty."""
    figure: str = ""
    """Instead: draw the paper's figure 3, both scenarios with symbols and with an automaton from random walks; a file,
    .svg, .png or .pdf."""
    strings: str = ""
    """Instead: write the symbols of random walks to this file, one walk a line."""
    walks: int = 1000
    """Number of random walks, for --strings and for inference."""
    longest: int = 30
    """Walks with more steps are left out."""
