"""Use replay as a regression test: record trials, change the core, and replay the trials with the changed core.

The script records two trials and replays them. Every command and decision is identical, and the exit code is 0. It then
changes one line in a copy of the core in a way that looks harmless: m (F - F0) becomes m F - m F0. Replaying the same
trials with this copy gives exit code 1, and the output gives the first tick, the field and the cause. A pipeline that
ends with ``palpate replay trials/`` therefore detects unintended changes in behaviour.

It takes about ten seconds.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path

from palpate import core
from palpate.adapters.cli.main import main as palpate

CHANGED_FILE = Path("motion", "controllers.py")
BEFORE, AFTER = "m * (fz - z)", "m * fz - m * z"


def replay_with(folder: Path, logs: Path) -> int:
    """Run ``palpate replay`` with the core in the given folder, and return the exit code."""
    # The core found first is the one that is used: palpate is a namespace package of several folders.
    places = [str(folder), *filter(None, [os.environ.get("PYTHONPATH")])]
    call = [sys.executable, "-m", "palpate.adapters.cli.main", "replay", str(logs)]
    return subprocess.run(call, env={**os.environ, "PYTHONPATH": os.pathsep.join(places)}, check=False).returncode


def change_core(folder: Path) -> None:
    """Copy the core to a folder, and change one line of the copy."""
    copy = folder / "palpate" / "core"
    shutil.copytree(Path(core.__file__).parent, copy, ignore=shutil.ignore_patterns("__pycache__"))
    text = (copy / CHANGED_FILE).read_text(encoding="utf-8")
    if text.count(BEFORE) != 1:
        sys.exit(f"{CHANGED_FILE} no longer holds {BEFORE!r}: choose another line to change")
    (copy / CHANGED_FILE).write_text(text.replace(BEFORE, AFTER), encoding="utf-8")


def main() -> None:
    """Parse the command line, and run the script."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("runs/replay-gate"), help="output folder; must not exist")
    options = parser.parse_args()
    if options.out.exists():
        parser.error(f"{options.out} exists; name another folder with --out")
    run, changed = options.out / "run", options.out / "changed"

    print("1. Record", flush=True)
    if code := palpate(["run", "--policy", "torque", "--trials", str(options.trials), "--out", str(run)]):
        sys.exit(code)

    print("\n2. Replay with the same core", flush=True)
    same = palpate(["replay", str(run)])
    print(f"exit code {same}")

    print(f"\n3. Replay with a core in which '{BEFORE}' is '{AFTER}'", flush=True)
    change_core(changed)
    other = replay_with(changed, run)
    print(f"exit code {other}")

    print(f"\nlook at the logs in {run}/logs (palpate log plot), and at {changed}/palpate/core/{CHANGED_FILE}")
    sys.exit(0 if (same, other) == (0, 1) else "the gate did not do what it should")


if __name__ == "__main__":
    main()
