"""Command-line options of ``palpate study``."""

from dataclasses import dataclass
from typing import Annotated

import tyro

from palpate.adapters.cli.options import Jobs, LiveSettings
from palpate.core.ports import Settings


@dataclass(frozen=True)
class StudyOptions(LiveSettings, Settings):
    """Many runs: every combination of settings, policies and seeds that a TOML file asks for, in a folder for each.

    The file:

      [study]
      trials = 150
      seeds = [0, 1, 2]                      # or { first = 0, count = 20 }
      policies = ["q-learning", "torque"]    # learners are trained; comparators and policy files run as they are
      job = "my-part.toml"                   # job file, from the folder of this file; without it the paper's peg

      [base]                                 # settings of all runs, as in a run.toml
      scenario = "paper"

      [grid]                                 # each with a list of values: all combinations
      "task.start_uncertainty_mm" = [1.0, 2.0]

    Instead of [grid], or besides it, tables under [[cells]] each name a set of settings. Trials are not recorded unless
    the file sets recording.enabled.

    The same command again goes on where it stopped, with more seeds, values or policies in the file too; what is
    finished is never made again. Results depend neither on the engine nor on the number of workers.

    Exit code 0: all cells are finished; 1: some failed; 2: the file, the folder or an option cannot be used; 130: ended
    by Ctrl-C.
    """

    file: Annotated[str, tyro.conf.Positional]
    """The study file (TOML)."""
    out: str = ""
    """Folder for the study; runs/NAME-OF-THE-FILE if not given."""
    engine: str = "processes"
    """sequential or processes."""
    jobs: Jobs = 0
    """Processes; 0 takes one per core."""
    yes: bool = False
    """Do not ask before a study of more than 1000 cells."""
