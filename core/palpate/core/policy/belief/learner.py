"""Learner that infers the hole's position from the end of each trial and acts on its belief over that position."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Final

import numpy as np
from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import LEARNED, Action, Decision, EpisodeOutcome, Observation
from palpate.core.policy.belief.arithmetic import Floats, logarithm
from palpate.core.policy.belief.contacts import LENGTH_M, ContactObservation, ContactTrial
from palpate.core.policy.belief.fit import MIN_CONTACTS, fit_contact_model
from palpate.core.policy.belief.model import ContactModel
from palpate.core.policy.belief.place_belief import MISSED, ContactTable, PlaceBelief
from palpate.core.policy.belief.places import SINGLE, Places, place_prior
from palpate.core.policy.belief.planner import Planner, SpiralSearch
from palpate.core.policy.learner import ModelLearner, TaskBounds
from palpate.core.ports import Range, Settings

SEARCH: Final = "search"
"""Name for search steps; steps chosen with the belief are named after their displacement."""
_WIDEST_M: Final = 8e-3
"""Maximum half-width; more than 161 by 161 cells cannot be processed within a tick."""

_MIDDLE_M: Final = (0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class BeliefParameters(Settings):
    """Belief learner parameters that do not follow from the task."""

    TABLE: ClassVar[str] = "learning.belief"

    capture_mm: Annotated[float, Range(0.02, 2.0)] = 0.15
    """Half-width around the peg's path within which a hole captures the peg."""
    speed_mm_s: Annotated[float, Range(1.0, 100.0)] = 19.0
    """Mean speed over the longest step, including pauses."""
    forgetting_factor: Annotated[float, Range(0.5, 1.0)] = 0.985
    """Forgetting factor for the evidence per contact, because the learned model may be slightly wrong."""
    search_speed_mm_s: Annotated[float, Range(1.0, 100.0)] = 16.0
    """Maximum search speed; at higher speeds the peg slides over holes."""
    pitch_mm: Annotated[float, Range(0.05, 5.0)] = 0.3
    """Distance between a search spiral's turns; above twice the capture width it leaves gaps."""
    memory_trials: Annotated[int, Range(2, 1000)] = 60
    """Number of remembered trials; older trials are forgotten."""
    restart_steps: Annotated[int, Range(1, 1000)] = 60
    """Number of belief steps until a search around the most likely position begins, after which the belief restarts.
    After the same number again, the whole area is searched until the end."""
    search_steps: Annotated[int, Range(1, 10000)] = 40
    """Number of steps in the search around the most likely position."""
    regrip_share: Annotated[float, Range(0.0, 0.5, above=True)] = 0.05
    """Prior probability that the tool's tilt differs from that in earlier trials."""
    other_tool: bool = False
    """Start from a policy file even if its contact model is for a different peg; otherwise such a file is rejected."""

    @override
    def check(self) -> None:
        accepted = f"at most twice capture_mm, {2.0 * self.capture_mm:g}, or a search leaves gaps"
        self.require("pitch_mm", self.pitch_mm <= 2.0 * self.capture_mm, accepted)


class BeliefLearner(ModelLearner[ContactTrial]):
    """A learner with a contact model, a belief over the hole's position, and a planner.

    Until a trial has ended in the hole there is no contact model, and the learner searches in a spiral.

    Args:
        bounds: Task bounds: the exploration area around the goal, and the longest step.

    Raises:
        ConfigurationError: The area has too many cells to process within a tick.
    """

    def __init__(self, parameters: BeliefParameters, bounds: TaskBounds, *, frozen: bool) -> None:
        half_width_m = bounds.half_width_m
        if half_width_m > _WIDEST_M:
            accepted = f"at most {_WIDEST_M * 1e3:g} mm from the goal to be explored, for a belief"
            raise ConfigurationError("task.area_half_width_mm", half_width_m * 1e3, accepted)
        super().__init__(frozen=frozen)
        self.parameters = parameters
        self._half_width_m = half_width_m
        self._places = Places(half_width_m)
        self.step_within(bounds)
        self._model: ContactModel | None
        self._table: ContactTable | None
        self._lag: float
        self._contacts: list[ContactObservation]
        self._belief: PlaceBelief | None
        self._search: SpiralSearch | None
        self._steps: int
        self._searched: int

    def step_within(self, bounds: TaskBounds) -> None:
        """Plan with the longest step from different task bounds, for a trial with its own force limit."""
        capture_m, search, speed = (
            each * 1e-3
            for each in (self.parameters.capture_mm, self.parameters.search_speed_mm_s, self.parameters.speed_mm_s)
        )
        self._search_step_m = min(search * bounds.action_s, bounds.longest_m)
        step_m = min(speed * bounds.action_s, bounds.longest_m)
        self._planner = Planner(self._places, capture_m, step_m)
        self._actions = {(x, y): Action(f"{x * 1e3:+.2f}{y * 1e3:+.2f}mm", (x, y)) for x, y in self._planner.moves}

    @property
    def model(self) -> ContactModel | None:
        """Return the contact model fitted to the trials so far, or None if they have too few contacts."""
        self._refit()
        return self._model

    def _begin(self, rng: np.random.Generator) -> None:
        self._contacts = []
        self._restart()
        self._searched = 0

    def _restart(self) -> None:
        """Reset the evidence for the current trial."""
        table, forgetting_factor = self._table, self.parameters.forgetting_factor
        self._belief = None if table is None else PlaceBelief(table, self._log_prior, forgetting_factor)
        self._search, self._steps = None, 0

    def _fit(self) -> None:
        prior = place_prior([trial.hole_m for trial in self._trials], self._places)
        self._log_prior, self._centre_m = logarithm(prior).astype(SINGLE), self._places.mean_m(prior)
        self._model = self._table = None
        if sum(len(trial.contacts) for trial in self._trials) < MIN_CONTACTS:
            return
        self._model = fit_contact_model(self._trials)
        self._table = ContactTable(self._model, self._places, self.parameters.regrip_share)
        self._lag = self._model.lag

    def choose(self, observation: Observation) -> Decision:
        """Return the step that minimises the expected time to the hole."""
        contact = ContactObservation.of(observation)
        if self._belief is None:
            self._contacts.append(contact)
            return self._searching(self._search or self._begin_search(self._centre_m), contact)
        self._belief.passed, cell = self._way_to(contact.place, self._belief.passed)
        self._contacts.append(contact)
        self._belief.feel(*cell, contact.torque_Nm, contact.load)
        self._steps += 1
        if self._search is not None:
            if self._searched > 1 or self._steps <= self.parameters.search_steps:
                return self._searching(self._search, contact)
            self._restart()
        probabilities = self._belief.probabilities()
        if self._steps > self.parameters.restart_steps:
            self._steps, self._searched = 0, self._searched + 1
            # A belief that failed twice is wrong: search the whole area, which is fastest from the middle.
            around_m = self._places.likeliest_m(probabilities) if self._searched == 1 else _MIDDLE_M
            return self._searching(self._begin_search(around_m), contact)
        displacement_m, actions = self._planner.best(probabilities, self._inside(contact.place_m), self._half_width_m)
        grounds = float(probabilities.max()), *self._places.mean_m(probabilities), actions
        return Decision(self._actions[displacement_m], None, LEARNED, grounds)

    def _way_to(self, place: tuple[int, int], passed: Floats) -> tuple[Floats, tuple[int, int]]:
        """Return the cell weights, updated along the path from the last contact, and the cell for the next torque."""
        before = self._contacts[-1].place if self._contacts else place
        (x, y), (px, py) = ((a * LENGTH_M, b * LENGTH_M) for a, b in (place, before))
        widths_m = [widths * (self.parameters.capture_mm * 1e-3) for widths, _ in MISSED]
        box, off_m2 = self._places.near_way((px, py), (x - px, y - py), max(widths_m))
        if self._contacts:
            passed = passed.copy()
            for width_m, (_, log_weight) in zip(widths_m, MISSED, strict=True):
                passed[box][off_m2 <= width_m * width_m] += log_weight
        felt_m = self._inside((x - self._lag * (x - px), y - self._lag * (y - py)))
        return passed, self._places.cell(*felt_m)

    def _inside(self, place_m: tuple[float, float]) -> tuple[float, float]:
        """Clamp a position to the belief's square."""
        edge = float(self._places.axis_m[-1])
        x, y = (min(max(value, -edge), edge) for value in place_m)
        return x, y

    def _begin_search(self, centre_m: tuple[float, float]) -> SpiralSearch:
        pitch_m = self.parameters.pitch_mm * 1e-3
        self._search = SpiralSearch(centre_m, pitch_m, self._search_step_m, self._half_width_m)
        return self._search

    def _searching(self, search: SpiralSearch, contact: ContactObservation) -> Decision:
        return Decision(Action(SEARCH, search.next_m(contact.place_m)), None, LEARNED)

    @override
    def end_trial(self, episode: EpisodeOutcome) -> None:
        if self.frozen or not episode.inserted:
            return
        self._remember(ContactTrial.of(episode, self._contacts))
        del self._trials[: -self.parameters.memory_trials]

    def _trial_from(self, where: str, data: object) -> ContactTrial:
        return ContactTrial.from_dict(where, data)
