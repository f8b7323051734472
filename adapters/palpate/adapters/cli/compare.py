"""The ``palpate compare`` command."""

import sys
from functools import partial
from pathlib import Path

from palpate.adapters.cli.notices import trips_line, validity_note
from palpate.adapters.cli.options import CompareOptions
from palpate.adapters.cli.progress import progress
from palpate.adapters.experiments import Run, RunFolder, note
from palpate.adapters.experiments import compare as compared


def compare(options: CompareOptions) -> int:
    """Run every strategy on the same trials, print a table of the results, and return the exit code."""
    config, trials = options.run, options.trials
    folder = RunFolder(Path(options.out or f"runs/{config.scenario}-compare"))
    found = compared(Run(config, notify=note), options.policy, trials, folder, partial(progress, trials, "trial"))
    reasons = [f"{name}: {line}" for name, s in found.summaries.items() if (line := trips_line(s))]
    ended = "" if found.finished else "; ended early"
    foot = f"{config.arm}, scenario {config.scenario}, seed {config.seed}, {trials} trials each{ended}\n"
    text = "".join((found.table(), *reasons, foot, validity_note(config)))
    folder.write("compare.txt", text)
    folder.write("compare.csv", found.csv())
    folder.write_json("summary.json", {"finished": found.finished, "policies": found.summaries})
    sys.stdout.write(f"\n{text}saved in {folder.path}\n")
    return int(bool(found.losses)) if found.finished else 130
