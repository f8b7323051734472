"""A policy of your own, beside the torque rule that palpate has.

Both step where the torque says that the hole is. The torque rule always goes 0.7 mm, and where it feels nothing it goes
anywhere. Ours makes shorter steps each time that the torque turns round, because then it has just passed the hole, and
goes on straight where it feels nothing. The hole is anywhere within 3 mm of at its nominal position.

You see a line for each policy: how many trials put the peg in, and the median time of exploration. Both get the same
trials. Takes some twenty seconds; with ``--quick`` a few seconds.
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
"""A torque below this is taken for none."""


class Homing(Policy):
    """Follows the torque with steps that shrink when it turns round."""

    @property
    def temperature(self) -> float | None:
        """There is none: it does not explore by chance."""
        return None

    def serves(self, state: int) -> bool:
        """It serves every state, because it looks at the torque itself."""
        return True

    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        """Forget the last trial; any random choice of this one has to come from ``rng``."""
        self._heading_rad, self._step_m = float(rng.uniform(0.0, 2 * pi)), FIRST_STEP_M

    def choose(self, observation: Observation) -> Decision:
        """Everything is in the task frame: SI units, z into the hole."""
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
        """It learns nothing."""


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=50)
    parser.add_argument("--quick", action="store_true", help="three trials")
    parser.add_argument("--out", type=Path, default=Path("runs/own-policy"), help="must not be there, or be empty")
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
