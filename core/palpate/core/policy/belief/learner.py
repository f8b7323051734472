"""Learns from the end of each trial where the hole was, and acts by a belief over where it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Final

import numpy as np
from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import LEARNED, Action, Decision, Hindsight, Observation
from palpate.core.policy.belief.arithmetic import Floats, logarithm
from palpate.core.policy.belief.fit import FEWEST_TOUCHES, fit_touch_model
from palpate.core.policy.belief.model import TouchModel
from palpate.core.policy.belief.place_belief import MISSED, PlaceBelief, TouchTable
from palpate.core.policy.belief.places import SINGLE, Places, place_prior
from palpate.core.policy.belief.planner import Planner, SpiralSearch
from palpate.core.policy.belief.touches import LENGTH_M, Touch, TouchedTrial, place_of
from palpate.core.policy.learner import ModelLearner
from palpate.core.ports import Range, Settings

SEARCH: Final = "search"
"""Name of the steps of a search; those by the belief are named by their way."""
_WIDEST_M: Final = 8e-3
"""More places than 161 by 161 cannot be gone through within a tick."""

_MIDDLE_M: Final = (0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class BeliefParameters(Settings):
    """Of the learner belief: what does not follow from the task."""

    TABLE: ClassVar[str] = "learning.belief"

    capture_mm: Annotated[float, Range(0.02, 2.0)] = 0.15
    """A hole within this distance of the peg's way takes it in."""
    speed_mm_s: Annotated[float, Range(1.0, 100.0)] = 19.0
    """Speed of a longest step, its rest included."""
    kept: Annotated[float, Range(0.5, 1.0)] = 0.985
    """Share of the evidence that is left after one more touch: what was learned may be a little wrong."""
    search_speed_mm_s: Annotated[float, Range(1.0, 100.0)] = 16.0
    """Highest speed of a search: faster, the peg slides over holes that it should drop into."""
    pitch_mm: Annotated[float, Range(0.05, 5.0)] = 0.3
    """Distance between the turns of a search; at most twice the capture width, or it leaves gaps."""
    memory_trials: Annotated[int, Range(2, 1000)] = 60
    """So many trials are remembered; what is older is forgotten."""
    patience: Annotated[int, Range(1, 1000)] = 60
    """After so many steps by the belief a search round the likeliest place begins, and then the belief anew; after as
    many again a search of everything, to the end."""
    search_steps: Annotated[int, Range(1, 10000)] = 40
    """Steps of the first of these searches."""
    regrip_share: Annotated[float, Range(0.0, 0.5, above=True)] = 0.05
    """How likely the tool leans otherwise than in the trials before."""
    other_tool: bool = False
    """Whether a policy file whose touch model is of another peg may be the beginning; else it is refused."""

    @override
    def check(self) -> None:
        accepted = f"at most twice capture_mm, {2.0 * self.capture_mm:g}, or a search leaves gaps"
        self.require("pitch_mm", self.pitch_mm <= 2.0 * self.capture_mm, accepted)


@dataclass(frozen=True, slots=True)
class _Way:
    """What does not need the torque of a touch.

    Attributes:
        place: That of the touch, in units of ``LENGTH_M``.
        passed: The belief's, with the places that were passed on the way.
        cell: Cell that the torque is of.
    """

    place: tuple[int, int]
    passed: Floats
    cell: tuple[int, int]


class BeliefLearner(ModelLearner[TouchedTrial]):
    """A touch model, a belief over the hole's place, and a planner on it.

    Until a trial has ended in the hole nothing is known of the touch, and the learner searches in a spiral.

    Args:
        half_width_m: Half the side of the square about the goal that may be explored.

    Raises:
        ConfigurationError: The square is so large that its places could not be gone through within a tick.
    """

    def __init__(self, parameters: BeliefParameters, half_width_m: float, action_s: float, *, frozen: bool) -> None:
        if half_width_m > _WIDEST_M:
            accepted = f"at most {_WIDEST_M * 1e3:g} mm from the goal to be explored, for a belief"
            raise ConfigurationError("task.area_half_width_mm", half_width_m * 1e3, accepted)
        super().__init__(frozen=frozen)
        self.parameters = parameters
        self._half_width_m = half_width_m
        self._search_step_m = parameters.search_speed_mm_s * 1e-3 * action_s
        self._places = Places(half_width_m)
        self._planner = Planner(self._places, parameters.capture_mm * 1e-3, parameters.speed_mm_s * 1e-3 * action_s)
        self._actions = {way: Action(_name(*way), way) for way in self._planner.ways}
        self._model: TouchModel | None
        self._table: TouchTable | None
        self._lag: float
        self._touches: list[Touch]
        self._belief: PlaceBelief | None
        self._foreseen: _Way | None
        self._search: SpiralSearch | None
        self._steps: int
        self._searched: int

    @property
    def model(self) -> TouchModel | None:
        """The touch model, fitted to what was learned so far; None while that is too little."""
        self._refit()
        return self._model

    @override
    def _begin(self, rng: np.random.Generator) -> None:
        self._touches, self._foreseen = [], None
        self._start_anew()
        self._searched = 0

    def _start_anew(self) -> None:
        """Forget the evidence of the trial so far."""
        table, kept = self._table, self.parameters.kept
        self._belief = None if table is None else PlaceBelief(table, self._log_prior, kept)
        self._search, self._steps = None, 0

    @override
    def _fit(self) -> None:
        self._expect_place()
        self._model = self._table = None
        if sum(len(trial.touches) for trial in self._trials) < FEWEST_TOUCHES:
            return
        self._model = fit_touch_model(self._trials)
        self._table = TouchTable(self._model, self._places, self.parameters.regrip_share)
        self._lag = self._model.lag

    def _expect_place(self) -> None:
        """The prior over places and its centre, by where the hole was so far."""
        prior = place_prior([trial.hole_m for trial in self._trials], self._places)
        self._log_prior, self._centre_m = logarithm(prior).astype(SINGLE), self._places.mean_m(prior)

    @override
    def foresee(self, place_m: tuple[float, float]) -> None:
        if self._belief is not None:
            self._foreseen = self._ready(place_of(place_m), self._belief)

    @override
    def choose(self, observation: Observation) -> Decision:
        """The step that brings the peg to the hole soonest, by what is believed."""
        touch = Touch.of(observation)
        way, self._foreseen = self._foreseen, None
        if self._belief is None:
            self._touches.append(touch)
            return self._searching(self._search or self._begin_search(self._centre_m), touch)
        if way is None or way.place != touch.place:
            way = self._ready(touch.place, self._belief)
        self._touches.append(touch)
        self._belief.passed = way.passed
        self._belief.feel(*way.cell, touch.torque_Nm, touch.load)
        self._steps += 1
        if self._search is not None:
            if self._searched > 1 or self._steps <= self.parameters.search_steps:
                return self._searching(self._search, touch)
            self._start_anew()
        probabilities = self._belief.probabilities()
        if self._steps > self.parameters.patience:
            self._steps, self._searched = 0, self._searched + 1
            # A belief that failed twice is wrong: from then on everything is searched, which a spiral does soonest from
            # the middle.
            around_m = self._places.likeliest_m(probabilities) if self._searched == 1 else _MIDDLE_M
            return self._searching(self._begin_search(around_m), touch)
        way_m, actions = self._planner.best(probabilities, self._inside(touch.place_m), self._half_width_m)
        grounds = float(probabilities.max()), *self._places.mean_m(probabilities), actions
        return Decision(self._actions[way_m], None, LEARNED, grounds)

    def _ready(self, place: tuple[int, int], belief: PlaceBelief) -> _Way:
        """The way to this place, and everything else that does not wait for what is felt there."""
        way = self._way_to(place, belief.passed)
        self._planner.foresee(self._inside((place[0] * LENGTH_M, place[1] * LENGTH_M)))
        return way

    def _way_to(self, place: tuple[int, int], passed: Floats) -> _Way:
        """The way from the last touch, at which so much was passed, to one at this place, in ``LENGTH_M``."""
        before = self._touches[-1].place if self._touches else place
        (x, y), (px, py) = ((a * LENGTH_M, b * LENGTH_M) for a, b in (place, before))
        widths_m = [widths * (self.parameters.capture_mm * 1e-3) for widths, _ in MISSED]
        box, off_m2 = self._places.near_way((px, py), (x - px, y - py), max(widths_m))
        if self._touches:
            passed = passed.copy()
            for width_m, (_, log_weight) in zip(widths_m, MISSED, strict=True):
                passed[box][off_m2 <= width_m * width_m] += log_weight
        felt_m = self._inside((x - self._lag * (x - px), y - self._lag * (y - py)))
        return _Way(place, passed, self._places.cell(*felt_m))

    def _inside(self, place_m: tuple[float, float]) -> tuple[float, float]:
        """A place, held to the square that the belief covers."""
        edge = float(self._places.axis_m[-1])
        x, y = (min(max(value, -edge), edge) for value in place_m)
        return x, y

    def _begin_search(self, centre_m: tuple[float, float]) -> SpiralSearch:
        pitch_m = self.parameters.pitch_mm * 1e-3
        self._search = SpiralSearch(centre_m, pitch_m, self._search_step_m, self._half_width_m)
        return self._search

    def _searching(self, search: SpiralSearch, touch: Touch) -> Decision:
        return Decision(Action(SEARCH, search.next_m(touch.place_m)), None, LEARNED)

    @override
    def end_trial(self, hindsight: Hindsight) -> None:
        if self.frozen or not hindsight.inserted:
            return
        self._remember(TouchedTrial.of(hindsight, self._touches))
        del self._trials[: -self.parameters.memory_trials]

    @override
    def _trial_from(self, where: str, data: object) -> TouchedTrial:
        return TouchedTrial.from_dict(where, data)


def _name(dx_m: float, dy_m: float) -> str:
    """Name of a step, such as ``+0.28-0.28mm``."""
    return f"{dx_m * 1e3:+.2f}{dy_m * 1e3:+.2f}mm"
