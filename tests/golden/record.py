"""Records the golden logs anew: ``make golden``.

To be run when the core is meant to behave otherwise than before; the commit that does so should say why. Each log
shows the gate another part of the core, and is kept short because all of them are in the repository.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
SHORT = ("--task.time-limit-s", "1.5")

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
    "torque-ur5": ("run", "--policy", "torque", "--trials", "1", "--seed", "3", "--arm", "ur5"),
    "omniscient-blind": ("run", "--policy", "omniscient", "--trials", "1", "--seed", "4", "--scenario", "blind"),
    "spiral-force-limit": (
        "run", "--policy", "spiral-10", "--trials", "1", "--seed", "5", "--task.max-force-N", "5.5",
    ),
}  # fmt: skip


def record(name: str, to: Path) -> None:
    """Run the command of that name and keep the log of its last trial."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        call = [sys.executable, "-m", "palpate.adapters.cli.main", *RECORDINGS[name], "--out", str(out)]
        subprocess.run(call, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        shutil.copyfile(sorted((out / "logs").glob("*.mcap"))[-1], to)


if __name__ == "__main__":
    for recording in RECORDINGS:
        log = HERE / f"{recording}.mcap"
        record(recording, log)
        sys.stdout.write(f"{recording}: {log.stat().st_size / 1000:.0f} kB\n")
