"""Record the golden logs: ``make golden``, or ``python -m tests.golden.record NAME ...`` for some of them.

Recording is for a change that is meant to alter behaviour; its commit says which and why. A log whose outcome or trip
reason differs from its recipe is reported, and the exit code is then 1.
"""

import shutil
import sys
import tempfile
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

from palpate.adapters.cli.main import main
from palpate.adapters.log import read_log
from tests.golden.fault_scenario import recorded
from tests.golden.scenarios import SCENARIOS

HERE = Path(__file__).parent
_JOBS = "examples/jobs/"
"""From the root of the repository, as all paths that a log keeps."""
_QUICK = ("--task.ready-height-mm", "1", "--task.tare-ticks", "7")
_SHORT = ("--task.time-limit-s", "1.5", *_QUICK)
_SHALLOW = ("--task.insertion-depth-mm", "2", "--cell.peg.hole-depth-mm", "2", *_QUICK)
_CORNER = ("--task", "insertion-6dof", "--policy", "corner-first", "--trials", "1")

COMMANDS = {
    # Learners, each with what it learned in the trials before: the log is that of the last trial.
    "train-paper": ("train", "--trials", "8", "--seed", "11", *_SHORT),
    "train-sarsa": (
        "train", "--learner", "sarsa", "--trials", "2", "--seed", "41", *_SHALLOW, "--task.time-limit-s", "1.6",
        "--task.start-uncertainty-mm", "0.6", "--task.ticks-per-action", "7",
    ),
    "train-belief": (
        "train", "--learner", "belief", "--trials", "2", "--seed", "4", "--job", _JOBS + "dowel-12-h7.toml",
        *_SHALLOW,
    ),
    # A belief that is soon given up, in much noise: searches around the likeliest place, then everywhere.
    "train-belief-lost": (
        "train", "--learner", "belief", "--scenario", "blind-noise", "--trials", "7", "--seed", "29", *_SHALLOW,
        "--learning.belief.restart_steps", "3", "--learning.belief.search-steps", "4",
        "--learning.belief.memory-trials", "4",
    ),
    # The model is fitted after 30 trials.
    "train-hmm": (
        "train", "--learner", "hmm", "--scenario", "blind", "--trials", "31", "--seed", "71", *_SHALLOW,
        "--task.time-limit-s", "0.6",
    ),
    "train-options": (
        "train", "--task", "insertion-6dof", "--learner", "options", "--scenario", "blind-square", "--trials", "2",
        "--seed", "7", *_SHALLOW, "--learning.optimistic-prior", "0", "--task.options", "corners", "4", "corner_mm",
        "20.5", "--task.time-limit-s", "3.1", "--task.ticks-per-action", "7",
    ),
    "train-options-round": (
        "train", "--task", "insertion-6dof", "--learner", "options", "--trials", "1", "--seed", "59", "--job",
        _JOBS + "paper-peg.toml", *_SHALLOW, "--task.time-limit-s", "2",
    ),
    # Perception, memory and programmed states.
    "train-mixed": (
        "train", "--trials", "3", "--seed", "12", *_SHORT, "--learning.programmed", "x- y0", "+x",
        "--learning.reinforcement", "effort", "--perception.filter-order", "1",
    ),
    "train-clusters": (
        "train", "--trials", "2", "--seed", "13", *_SHORT, "--perception.symbols", "clusters",
        "--perception.features", "pca", "--perception.fit-trials", "2",
    ),
    "train-som": (
        "train", "--trials", "2", "--seed", "22", *_SHORT, "--perception.symbols", "random", "--perception.features",
        "som", "--perception.som-side", "4", "--perception.fit-trials", "2", "--perception.symbol-count", "9",
        "--perception.memory", "last-2",
    ),
    "train-grid": (
        "train", "--trials", "2", "--seed", "23", *_SHORT, "--perception.symbols", "grid", "--task.area-centre",
        "start", "--task.start-shape", "ball", "--arm", "ur5",
    ),
    "train-automaton": (
        "train", "--trials", "2", "--seed", "48", *_SHORT, "--perception.memory", "tests/golden/automaton.json",
        "--task.directions", "6",
    ),
    "train-examples": (
        "train", "--trials", "2", "--seed", "24", *_SHORT, "--scenario", "blind", "--learning.examples",
        "tests/golden/examples.csv",
    ),
    # Policies in use, and baselines.
    "frozen-policy": ("run", "--trials", "1", "--seed", "25", *_SHORT, "--policy", "train-paper"),
    "torque-ur5": ("run", "--policy", "torque", "--trials", "1", "--seed", "3", "--arm", "ur5", *_SHALLOW),
    "oracle-blind": (
        "run", "--policy", "oracle", "--trials", "1", "--seed", "4", "--scenario", "blind", *_SHALLOW,
    ),
    "spiral-force-limit": (
        "run", "--policy", "spiral-10", "--trials", "1", "--seed", "5", "--task.max-force-N", "5.5",
    ),
    "random-blind": (
        "run", "--policy", "random", "--trials", "1", "--seed", "7", "--scenario", "blind", *_SHALLOW,
        "--task.time-limit-s", "0.5",
    ),
    "claims-done": (
        "run", "--policy", "tests.golden.claims:Claims", "--trials", "1", "--seed", "6", "--scenario", "blind",
        *_SHALLOW,
    ),
    # Six degrees of freedom: a square and a keyed peg.
    "corner-first": ("run", *_CORNER, "--seed", "4", "--job", _JOBS + "square-20.toml", *_SHALLOW[:4]),
    "flat-first": ("run", *_CORNER, "--seed", "36", "--scenario", "blind-keyed", *_SHALLOW),
    "oracle-pose": (
        "run", "--task", "insertion-6dof", "--policy", "oracle-pose", "--trials", "1", "--seed", "36", "--scenario",
        "blind-square", *_SHALLOW,
    ),
}  # fmt: skip

CLAIMS = {
    "train-hmm": "time limit",
    "train-sarsa": "inserted",
    "train-belief": "inserted",
    "torque-ur5": "inserted",
    "oracle-blind": "inserted",
    "spiral-force-limit": "force limit",
    "claims-done": "wedged",
    "corner-first": "inserted",
    "oracle-pose": "inserted",
    **{name: one.shows for name, one in SCENARIOS.items()},
}
"""Outcome and trip reason that logs must have; other recipes show a learner, however its trial ends."""

NAMES = (*COMMANDS, *SCENARIOS)
"""All golden logs."""


def shown(log):
    """Return outcome and trip reason of a log, or what raised the error that ended it."""
    if log.end is None:
        return "cut short"
    trips = [event.detail.partition(":")[0] for event in log.events if event.name == "trip"]
    return ", ".join([log.end.outcome or f"error, {log.end.raised_by}", *trips])


def record(name, to):
    """Run the fault scenario of that name, or the command, and keep the log of its last trial."""
    if name in SCENARIOS:
        to.write_bytes(recorded(SCENARIOS[name]))
        return
    with tempfile.TemporaryDirectory() as folder:
        out = _run(name, Path(folder))
        shutil.copyfile(sorted((out / "logs").glob("*.mcap"))[-1], to)


def _run(name, folder):
    """Run the command of that name; return its run folder.

    A policy with the name of a command is the one that this command saves.
    """
    out, words = folder / name, [*COMMANDS[name]]
    if words[-1] in COMMANDS:
        words[-1] = str(_run(words[-1], folder) / "policy.json")
    printed = StringIO()
    with redirect_stdout(printed), redirect_stderr(printed):
        code = main([*words, "--out", str(out)])
    if not any((out / "logs").glob("*.mcap")):
        raise SystemExit(f"{name} ended with {code} and recorded nothing:\n{printed.getvalue()}")
    return out


def record_all(names):
    """Record these logs and report those that do not show what their recipes claim."""
    wrong = 0
    for name in names:
        log = HERE / f"{name}.mcap"
        record(name, log)
        found = shown(read_log(log))
        claim = CLAIMS.get(name, found)
        wrong += found != claim
        sys.stdout.write(f"{name}: {found}, {log.stat().st_size / 1000:.0f} kB\n")
        if found != claim:
            sys.stdout.write(f"    but the recipe claims: {claim}\n")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(record_all(sys.argv[1:] or list(NAMES)))
