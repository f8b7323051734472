"""For a round peg in a grip that leans: many hypotheses of hole and lean at once, weighed by every touch."""

from math import hypot, inf
from typing import Final

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from palpate.core.policy import Action, Decision, FixedPolicy, Law, Observation, Spatial, drawing_from
from palpate.core.tasks.insertion_6dof.options import SpatialOptions
from palpate.core.trial import ExplorationArea, TaskConfig

NAME: Final = "hypotheses"
_COUNT: Final = 1500
_LEAN_RAD: Final = 7e-3
"""No more than this, about each axis, the tool leans when a trial begins."""
_LEVER_PER_LEAN_M: Final = 10.0
"""By how much more per rad of lean the press acts beside the axis, until it acts at the rim: stiffness against tilting
over force."""
_SOFT_M: Final = 6e-3
"""An upright tool's press acts half of this away from the hole."""
_LEVER_M: Final = 3e-3
"""A lever differs by so much from what a true hypothesis gives; the tails are Student's, for steps that stick."""
_SEEN_M: Final = 0.15e-3
_MISSED: Final = 0.1
"""Where the tool passed as near as ``_SEEN_M`` and did not sink, the hole is less likely by this."""
_LIVE_SHARE: Final = 0.7
"""Of the torque: the filtered one is that of the place before."""
_ALIKE_M: Final = 1e-3
_ALIKE_RAD: Final = 1.5e-3
"""Hypotheses that differ by no more than these are one, and their mean is acted on."""
_STEP_M: Final = 1e-3
_PAST_M: Final = 0.25e-3
"""A step goes on past the place that is meant, which is known no better."""
_TURN_RAD: Final = 5e-3
_FRESH: Final = 20
"""Of those drawn anew every so manieth may be anything again: a hole may have been passed and not felt."""
_MOVED: Final = (0.2e-3, 0.2e-3, 0.25e-3, 0.25e-3)
"""Hypotheses drawn anew differ from the old by so much at most: places in m, leans in rad."""

Floats = NDArray[np.float64]


class Hypotheses(FixedPolicy):
    """Acts as if one hypothesis, drawn by weight, were true: steps to its hole, turned so that it stands level there.

    A peg that leans bears with its lowest point, or, where that is over the hole, with the hole's edge to both sides of
    it. In the first case the torque shows the lean alone, in the second only which line the hole is on, or nothing:
    a tool that leans into the hole balances on both edges. Giving way to the torque ends there, and steps by torque
    go in circles. Touches at several places and leans tell the cases apart.

    Args:
        task: The hole is anywhere in its area.
        options: The peg's rim is as far from its axis as corners are.
    """

    def __init__(self, task: TaskConfig, options: SpatialOptions) -> None:
        super().__init__()
        self._task, self._rim_m = task, options.corner_mm * 1e-3

    @override
    def choose(self, observation: Observation) -> Decision:
        """Giving way at first, which finds the lean where the hole does not hide it; then steps that turn."""
        rng = drawing_from(self._rng, NAME)
        x, y, _ = observation.reference_m
        if observation.action_number == 0:
            area, lean = ExplorationArea.of(self._task, (x, y)), _LEAN_RAD
            least, most = (area.clamp(far, far) for far in (-inf, inf))
            self._bounds = np.array([(*least, -lean, -lean), (*most, lean, lean)])[:, :, None]
            self._from_m, self._at = (x, y), self._anywhere(rng, _COUNT)
            self._weights = np.full(_COUNT, 1.0 / _COUNT)
        self._weigh(observation)
        if observation.action_number == 0:
            return Decision(Action("give way", (0.0, 0.0), Spatial(Law.GIVE_WAY)), None, NAME)
        to_x, to_y, lean_x, lean_y = meant = self._drawn(rng)
        self._from_m = x, y
        (dx, dy), (turned_x, turned_y, _) = (to_x - x, to_y - y), observation.turn_rad
        way_m = max(hypot(dx, dy), 1e-9)
        step = min(way_m + _PAST_M, _STEP_M) / way_m
        turn_x, turn_y = lean_x - turned_x, lean_y - turned_y
        share = min(1.0, _TURN_RAD / max(hypot(turn_x, turn_y), 1e-9))
        spatial = Spatial(Law.STEP, turn_rad=(share * turn_x, share * turn_y, 0.0))
        return Decision(Action("step and turn", (step * dx, step * dy), spatial), None, NAME, meant)

    def _anywhere(self, rng: np.random.Generator, count: int) -> Floats:
        least, most = self._bounds
        return rng.uniform(least, most, (4, count))

    def _weigh(self, observation: Observation) -> None:
        """By the torque, and by where the tool came past and did not sink."""
        (x, y, _), press_N = observation.position_m, max(-observation.force_N[2], 1.0)
        lever_x, lever_y = (
            (_LIVE_SHARE * live + (1.0 - _LIVE_SHARE) * filtered) / press_N
            for live, filtered in zip(observation.live_torque_Nm[:2], observation.torque_Nm[:2], strict=True)
        )
        # Along the torque of a press on the side away from the hole, and across it.
        dx, dy = self._at[0] - x, self._at[1] - y
        away_m = np.sqrt(dx * dx + dy * dy) + 1e-9
        along_x, along_y = dy / away_m, -dx / away_m
        lean_x, lean_y = (_LEVER_PER_LEAN_M * (self._at[k] - observation.turn_rad[k - 2]) for k in (2, 3))
        along, across = lean_x * along_x + lean_y * along_y, lean_y * along_x - lean_x * along_y
        # There is no plate on the side of the hole.
        along = 0.5 * (along + np.sqrt(along * along + _SOFT_M * _SOFT_M))
        inside = np.minimum(1.0, self._rim_m / np.sqrt(along * along + across * across))
        error_along = lever_x * along_x + lever_y * along_y - inside * along
        error_across = lever_y * along_x - lever_x * along_y - inside * across
        misfit = 1.0 + (error_along * error_along + error_across * error_across) / (2.0 * _LEVER_M * _LEVER_M)
        weights = self._weights / (misfit * misfit)
        weights[self._passed(observation)] *= _MISSED
        self._weights = weights / weights.sum()

    def _passed(self, observation: Observation) -> NDArray[np.bool_]:
        """Which of the places the last step came past."""
        (from_x, from_y), (x, y, _) = self._from_m, observation.reference_m
        way_x, way_y = x - from_x, y - from_y
        dx, dy = self._at[0] - from_x, self._at[1] - from_y
        share = np.clip((dx * way_x + dy * way_y) / max(way_x * way_x + way_y * way_y, 1e-12), 0.0, 1.0)
        dx, dy = dx - share * way_x, dy - share * way_y
        passed: NDArray[np.bool_] = dx * dx + dy * dy < _SEEN_M * _SEEN_M
        return passed

    def _drawn(self, rng: np.random.Generator) -> tuple[float, ...]:
        """One hypothesis, as the mean of all that are like it; where few count, all are drawn anew about these."""
        if np.square(self._weights).sum() > 2.0 / _COUNT:
            drawn = self._sampled((np.arange(_COUNT) + rng.uniform()) / _COUNT)
            moved = np.array(_MOVED)[:, None]
            self._at = np.clip(self._at[:, drawn] + rng.uniform(-moved, moved, (4, _COUNT)), *self._bounds)
            self._at[:, ::_FRESH] = self._anywhere(rng, _COUNT // _FRESH)
            self._weights = np.full(_COUNT, 1.0 / _COUNT)
        one = int(self._sampled(rng.uniform()))
        apart = self._at - self._at[:, one : one + 1]
        alike = (np.square(apart[:2]).sum(axis=0) < _ALIKE_M * _ALIKE_M) & (
            np.square(apart[2:]).sum(axis=0) < _ALIKE_RAD * _ALIKE_RAD
        )
        weights = self._weights * alike
        mean: list[float] = ((self._at * weights).sum(axis=1) / weights.sum()).tolist()
        return tuple(mean)

    def _sampled(self, shares: Floats | float) -> NDArray[np.intp]:
        """Which ones stand there if all are put one beside the other, each as wide as its weight."""
        ends = np.cumsum(self._weights)
        sampled: NDArray[np.intp] = np.searchsorted(ends, shares * ends.max())
        return sampled
