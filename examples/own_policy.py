"""Compare a policy of your own with palpate's torque rule.

Both policies step towards the hole as indicated by the torque. The torque rule takes steps of 0.7 mm, in a random
direction if there is no torque. The new policy shortens its steps each time the torque reverses, because it has just
passed the hole; without torque it continues straight ahead. The hole is within 3 mm of its nominal position.

The script prints the number of successful trials and the median exploration time for each policy, using the same trials
for both. It takes about twenty seconds, or a few seconds with ``--quick``.
"""

from __future__ import annotations

import argparse
from math import atan2, cos, hypot, pi, sin
from pathlib import Path
from statistics import median

import numpy as np

from palpate.adapters.experiments import Run, learning_curve
from palpate.adapters.files import new_folder, require_free_folder
from palpate.core.errors import PalpateError, require_whole
from palpate.core.policy import Action, Decision, Observation, Policy, Transition

FIRST_STEP_M, SHORTEST_STEP_M = 0.7e-3, 0.2e-3
FELT_Nm = 0.005
"""Torque below which there is assumed to be none."""


class Homing(Policy):
    """A policy that follows the torque, with steps that become shorter each time the torque reverses."""

    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        """Reset the policy for a new trial. All random choices in the trial must use ``rng``."""
        self._heading_rad, self._step_m = float(rng.uniform(0.0, 2 * pi)), FIRST_STEP_M

    def choose(self, observation: Observation) -> Decision:
        """Choose a step. All quantities are in SI units and in the task frame, with z into the hole."""
        tx, ty, _ = observation.torque_Nm
        if hypot(tx, ty) > FELT_Nm:
            # Pressed beside the hole, the peg is supported on the far side only: the hole is at heading (-ty, tx).
            heading = atan2(tx, -ty)
            if cos(heading - self._heading_rad) < 0.0:
                self._step_m = max(self._step_m / 2, SHORTEST_STEP_M)
            self._heading_rad = heading
        step = (self._step_m * cos(self._heading_rad), self._step_m * sin(self._heading_rad))
        # No index: the step is not of the eight that a learner chooses from, so nothing learns from it.
        return Decision(Action("homing", step), index=None, source="homing")

    def learn(self, transition: Transition) -> None:
        """Do nothing, because this policy does not learn."""


def main() -> None:
    """Parse the command line, and run the script."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=50)
    parser.add_argument("--quick", action="store_true", help="run only three trials")
    parser.add_argument("--out", type=Path, default=Path("runs/own-policy"), help="output folder; must be new or empty")
    options = parser.parse_args()
    trials = 3 if options.quick else options.trials
    try:
        require_whole("trials", trials, 1, 1_000_000)
        require_free_folder(options.out)
        run = Run(scenario="blind")
        with new_folder(options.out) as folder:
            for name, policy in {"torque": "torque", "homing": Homing()}.items():
                rows = run.evaluate(trials, policy).rows
                times = [row.exploration_time_s for row in rows]
                print(
                    f"{name}: {sum(row.success for row in rows)} of {len(rows)} inserted, median {median(times):.2f} s"
                )
                (folder / f"{name}.png").write_bytes(learning_curve(rows, f"{name}, scenario blind"))
    except (PalpateError, OSError) as error:
        parser.error(str(error))
    print(f"look at {options.out}/torque.png and {options.out}/homing.png")


if __name__ == "__main__":
    main()
