"""Command-line options of ``palpate study``."""

from dataclasses import dataclass, field
from typing import Annotated

import tyro

from palpate.adapters.cli.options import Jobs, LiveSettings, RunSettings, Trials
from palpate.adapters.experiments import Claim
from palpate.core.ports import Settings


@dataclass(frozen=True)
class ProveOptions(RunSettings):
    """Many trials of one policy, and whether they prove a claim about it: how many succeed, with what force.

    Trials are dealt out over seeds, 50 each, from --seed on, and made by several processes. The same command again
    goes on where it stopped. The slowest, the hardest and those that failed are made once more, recorded, in the
    folder kept: logs and pictures to be looked at.

    Exit code 0: proved; 1: refuted, or neither; 2: something cannot be used; 130: ended by Ctrl-C.
    """

    policy: str = ""
    """A policy file, or omniscient, torque, spiral-10, spiral-5, random."""
    trials: Trials = 1000
    """Number of trials, rounded up to whole seeds."""
    claim: Claim = field(default_factory=Claim)
    out: str = ""
    """Folder for the proof; runs/SCENARIO-proof if not given."""
    jobs: Jobs = 0
    """Processes; 0 takes one per core. What comes of it does not depend on it."""


@dataclass(frozen=True)
class StudyOptions(LiveSettings, Settings):
    """Many runs: every combination of settings, policies and seeds that a TOML file asks for, in a folder for each.

    The file:

      [study]
      trials = 150
      seeds = [0, 1, 2]                      # or { first = 0, count = 20 }
      policies = ["q-learning", "torque"]    # learners are trained; comparators and policy files run as they are

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
