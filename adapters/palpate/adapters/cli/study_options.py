"""Command-line options of ``palpate study``."""

from dataclasses import dataclass
from typing import Annotated

import tyro

from palpate.adapters.cli.options import Jobs
from palpate.core.ports import Settings


@dataclass(frozen=True)
class StudyOptions(Settings):
    """Run every combination of settings, policies and seeds of a TOML file, each in a folder of its own.

    The file:

      [study]
      trials = 150
      seeds = [0, 1, 2]                      # or their number
      policies = ["q-learning", "torque"]    # learners are trained; comparators and policy files run as they are
      job = "my-part.toml"                   # job file, from the folder of this file; without it the paper's peg

      [base]                                 # settings of all conditions, as in a run.toml
      scenario = "paper"

      [grid]                                 # a list of values for each setting: all combinations
      "task.start_uncertainty_mm" = [1.0, 2.0]

    Several [[grid]] tables are run one after the other. Trials are not recorded unless the file sets recording.enabled.

    The same command continues where it stopped. Results depend neither on the number of workers nor on their order.

    Exit code 0: all conditions are finished; 1: some failed; 2: the file, the folder or an option cannot be used; 130:
    ended by Ctrl-C.
    """

    file: Annotated[str, tyro.conf.Positional]
    """The study file (TOML)."""
    out: str = ""
    """Folder for the study; runs/NAME-OF-THE-FILE if not given."""
    jobs: Jobs = 0
    """Processes; 0 takes one per core."""
    scheduler: str = ""
    """Dask scheduler that runs the conditions: tcp:// on loopback, tls://, or local to start one with --jobs workers.
    Workers need this palpate and the folder of the study: pip install 'palpate[cluster]'."""
