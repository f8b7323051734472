"""Records the golden logs anew: ``make golden``, or those that are named.

To be run when the core is meant to behave otherwise than before; the commit that does so should say why. Each log
shows the gate another part of the core, and is kept short because all of them are in the repository.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.golden.mishap import recorded
from tests.golden.mishaps import MISHAPS

HERE = Path(__file__).parent
SHORT = ("--task.time-limit-s", "1.5", "--task.ready-height-mm", "1", "--task.tare-ticks", "7")
SHORTER = ("--task.time-limit-s", "0.9", *SHORT[2:])
SHALLOW = (
    "--task.insertion-depth-mm", "2", "--cell.peg.hole-depth-mm", "2", "--task.ready-height-mm", "1",
    "--task.tare-ticks", "7",
)  # fmt: skip
SKILLS = (
    "train", "--task", "insertion-6dof", "--learner", "skills", "--scenario", "blind-square",
    "--task.ready-height-mm", "1", "--task.tare-ticks", "7", "--learning.rule-lead", "0",
    "--task.options", "corners", "4", "corner_mm", "20.5",
)  # fmt: skip
HASTY = (
    "--task.ticks-per-action", "2", "--task.no-prove-contact", "--cell.sensor.force-noise-N", "0",
    "--cell.sensor.torque-noise-Nm", "0",
)  # fmt: skip

RECORDINGS: dict[str, tuple[str, ...]] = {
    # Learning, with what was learned in the trials before: the last of several.
    "train-paper": ("train", "--trials", "8", "--seed", "11", *SHORT),
    "train-mixed": (
        "train", "--trials", "3", "--seed", "12", *SHORT, "--learning.programmed", "x- y0", "+x",
        "--learning.reinforcement", "effort", "--perception.filter-order", "1",
    ),
    "train-clusters": (
        "train", "--trials", "2", "--seed", "13", *SHORT, "--perception.symbols", "clusters",
        "--perception.features", "pca", "--perception.fit-trials", "2",
    ),
    # Pressing so lightly that some touches show less than a touch has at least.
    "train-belief": (
        "train", "--learner", "belief", "--trials", "4", "--seed", "27", *SHALLOW, "--task.press-kgf", "0.16",
        "--task.contact-kgf", "0.05",
    ),
    "train-belief-blind": (
        "train", "--learner", "belief", "--scenario", "blind", "--trials", "4", "--seed", "28", *SHALLOW,
    ),
    # A belief that is soon given up, in much noise: searches round the likeliest place, then of everything.
    "train-belief-lost": (
        "train", "--learner", "belief", "--scenario", "blind-noise", "--trials", "7", "--seed", "29", *SHALLOW,
        "--learning.belief.patience", "3", "--learning.belief.search-steps", "4",
        "--learning.belief.memory-trials", "4",
    ),
    # Holes as far off as there are, a zero that no tare sees, a peg that leans.
    "train-belief-far": (
        "train", "--learner", "belief", "--scenario", "blind-5", "--trials", "5", "--seed", "30", *SHALLOW,
        "--cell.tilt-mrad", "2", "--cell.tilt-heading-deg", "40",
    ),
    # Beside programmed states.
    "train-belief-mixed": (
        "train", "--learner", "belief", "--scenario", "blind", "--trials", "3", "--seed", "61", *SHALLOW,
        "--learning.programmed", "x- y0", "+x",
    ),
    "torque-ur5": ("run", "--policy", "torque", "--trials", "1", "--seed", "3", "--arm", "ur5", *SHALLOW),
    "omniscient-blind": (
        "run", "--policy", "omniscient", "--trials", "1", "--seed", "4", "--scenario", "blind", *SHALLOW,
    ),
    "spiral-force-limit": (
        "run", "--policy", "spiral-10", "--trials", "1", "--seed", "5", "--task.max-force-N", "5.5",
    ),
    "train-memory": (
        "train", "--trials", "3", "--seed", "21", *SHORT, "--perception.memory", "last-2",
        "--learning.reinforcement", "effort", "--learning.temperature", "0.9",
        "--learning.temperature-floor", "0.3",
    ),
    "train-som": (
        "train", "--trials", "2", "--seed", "22", *SHORT, "--perception.symbols", "random", "--perception.features",
        "som", "--perception.som-side", "4", "--perception.fit-trials", "2", "--perception.symbol-count", "9",
    ),
    "train-grid": (
        "train", "--trials", "2", "--seed", "23", *SHORT, "--perception.symbols", "grid", "--task.area-centre", "start",
        "--task.start-shape", "ball", "--arm", "ur5",
    ),
    # A search in even steps, as it begins before anything is known; and a second one between its turns.
    "train-belief-even": (
        "train", "--learner", "belief", "--scenario", "blind", "--trials", "1", "--seed", "46", *SHALLOW,
        "--task.time-limit-s", "1.2", "--task.area-half-width-mm", "1", "--task.start-uncertainty-mm", "0.5",
    ),
    # States of an automaton that follows the symbols, and steps in six directions.
    "train-automaton": (
        "train", "--trials", "2", "--seed", "48", *SHORTER, "--perception.memory", "tests/golden/automaton.json",
        "--task.directions", "6",
    ),
    # Neither greedy nor nearly even: what is drawn depends on every value, and these lie where an exponential is 0.
    "train-cool": (
        "train", "--trials", "3", "--seed", "26", *SHORT, "--learning.temperature", "0.9",
        "--learning.temperature-floor", "0.3", "--learning.reinforcement", "effort", "--learning.initial-value", "-400",
    ),
    "train-sarsa": (
        "train", "--learner", "sarsa", "--trials", "2", "--seed", "41", *SHALLOW, "--task.time-limit-s", "1.6",
        "--task.start-uncertainty-mm", "0.6", "--task.ticks-per-action", "7",
    ),
    "train-examples": (
        "train", "--trials", "2", "--seed", "24", *SHORT, "--scenario", "blind", "--learning.examples",
        "tests/golden/examples.csv",
    ),
    "frozen-policy": (
        "run", "--trials", "1", "--seed", "25", *SHORT, "--policy", "train-paper",
    ),
    "random-blind": (
        "run", "--policy", "random", "--trials", "1", "--seed", "7", "--scenario", "blind", *SHALLOW,
        "--task.time-limit-s", "0.5",
    ),
    # A policy with a programmed part, saved and read again.
    "frozen-mixed": (
        "run", "--trials", "1", "--seed", "45", "--task.time-limit-s", "0.4", "--perception.filter-order", "1",
        "--policy", "train-mixed",
    ),
    # Hypotheses that are drawn anew, and steps that turn.
    "hypotheses": (
        "run", "--task", "insertion-6dof", "--policy", "hypotheses", "--trials", "1", "--seed", "36", *SHALLOW,
        "--task.time-limit-s", "0.25", "--task.start-uncertainty-mm", "2", "--cell.tilt-mrad", "4",
        "--task.ticks-per-action", "6", "--task.options", "corner_mm", "14.5",
    ),
    # Wedged, driven, withdrawn, and the next corner.
    "corner-missed": (
        "run", "--task", "insertion-6dof", "--policy", "corner-first", "--trials", "1", "--seed", "4",
        "--cell.peg.cross-section", "square", "--task.options", "corners", "4", "corner_mm", "20.5",
        "--cell.peg.friction", "0.6", "--cell.conditions.yaw-deg", "10", "--cell.conditions.plate-lean-mrad", "17.5",
        "--cell.tilt-mrad", "4", "--cell.hole-uncertainty-mm", "5", "--task.time-limit-s", "3.5",
        "--task.ready-height-mm", "1", "--task.tare-ticks", "7", "--task.ticks-per-action", "7",
    ),
    # The flat of a keyed peg first.
    "flat-first": (
        "run", "--task", "insertion-6dof", "--policy", "corner-first", "--trials", "1", "--seed", "36",
        "--cell.peg.cross-section", "keyed", "--task.options", "flat_deg", "37.5", "corner_mm", "11.5",
        "inside_mm", "2", "lean_deg", "6", "down_share", "0.75", "--task.insertion-depth-mm", "3",
        "--cell.peg.hole-depth-mm", "3", "--cell.tilt-mrad", "0.5", "--task.ready-height-mm", "1",
        "--task.tare-ticks", "7", "--task.ticks-per-action", "10", "--cell.conditions.yaw-deg", "2",
        "--task.start-uncertainty-mm", "1",
    ),
    # Programmed skills that a learner chooses from, in actions so short that a push lasts as long as any skill may, a
    # drive comes to its end, and a push goes as far out as it may.
    "train-skills": (
        *SKILLS, "inside_mm", "4", "--seed", "59", "--trials", "1", "--task.time-limit-s", "1.6", *HASTY,
        "--control.axial-stiffness-N-per-mm", "9", "--task.area-half-width-mm", "4.5",
        "--task.start-uncertainty-mm", "1",
    ),
    # A gripper softer than its setting lets the plate seem as deep as a hole: what is inserted there comes back.
    "train-skills-inserted": (
        *SKILLS, "--seed", "7", "--trials", "1", "--task.time-limit-s", "1.6", *HASTY,
        "--control.axial-stiffness-N-per-mm", "9",
    ),
    # Of a peg without corners, which leans over a place of its rim.
    "train-skills-round": (
        "train", "--task", "insertion-6dof", "--learner", "skills", "--trials", "1", "--seed", "59",
        "--task.ready-height-mm", "1", "--task.tare-ticks", "7", "--learning.rule-lead", "0",
        "--task.start-uncertainty-mm", "1", "--task.time-limit-s", "0.16", *HASTY, "--task.options", "corner_mm",
        "14.5",
    ),
    # Drawn out of a hole by a lean, and driven.
    "train-skills-drawn": (
        *SKILLS, "--seed", "7", "--trials", "2", "--task.time-limit-s", "3.1", "--task.ticks-per-action", "7",
    ),
}  # fmt: skip


NAMES: tuple[str, ...] = (*RECORDINGS, *MISHAPS)
"""All golden logs."""


def record(name: str, to: Path) -> None:
    """Run the trial of that name, or the command and keep the log of its last trial."""
    if name in MISHAPS:
        to.write_bytes(recorded(MISHAPS[name]))
        return
    with tempfile.TemporaryDirectory() as folder:
        out = run_recording(name, Path(folder))
        shutil.copyfile(sorted((out / "logs").glob("*.mcap"))[-1], to)


def run_recording(name: str, folder: Path) -> Path:
    """Run the command of that name in a folder; returns its run folder.

    A policy that has the name of a recording is what that one saves.
    """
    out, call = folder / name, [sys.executable, "-m", "palpate.adapters.cli.main", *RECORDINGS[name]]
    if call[-1] in RECORDINGS:
        call[-1] = str(run_recording(call[-1], folder) / "policy.json")
    # A trial that trips ends the command with 1.
    subprocess.run([*call, "--out", str(out)], check=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return out


if __name__ == "__main__":
    for recording in sys.argv[1:] or NAMES:
        log = HERE / f"{recording}.mcap"
        record(recording, log)
        sys.stdout.write(f"{recording}: {log.stat().st_size / 1000:.0f} kB\n")
