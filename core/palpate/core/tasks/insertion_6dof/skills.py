"""The programmed skills that a learner chooses from: options, each with its own beginning and end."""

from dataclasses import replace
from math import copysign, hypot, radians, sin
from typing import Final

import numpy as np
from typing_extensions import override

from palpate.core.perception import Perception, Situations
from palpate.core.policy import Action, Decision, Law, Observation, Policy, Reinforcement, Spatial
from palpate.core.tasks.insertion import Agent
from palpate.core.tasks.insertion_6dof.corner import UPRIGHT_RAD, Corner
from palpate.core.tasks.insertion_6dof.corner_first import (
    CAUGHT_M,
    DRIVE_RAD,
    DRIVEN_ACTIONS,
    HANGS_M,
    LONGEST_PUSH,
    ON_PLATE_M,
    QUIET_ACTIONS,
    QUIET_NM,
    WALL_N,
)
from palpate.core.tasks.insertion_6dof.options import SpatialOptions

_LEAN, _PUSH, _DRIVE, _STAND, _INSERT, _WITHDRAW = KINDS = ("lean", "push", "drive", "stand", "insert", "withdraw")
_FAR_SHARE: Final = 0.7
"""A tool that is so far out, as a share of the area's half width, is pushed no further."""
_LEANS_DEG: Final = (5.0, 6.0)
"""Less lets a corner down so little that one in three or four slips out; more makes it a lever between its walls."""
_PUSHES_N: Final = (2.0, 3.0, 4.0)
_STANDS_DEG: Final = (1.0, 1.6)


SKILLS: Final = tuple(
    Action(name, (0.0, 0.0), spatial)
    for name, spatial in (
        *((f"{_LEAN} {deg:g} deg", Spatial(Law.LIFT, turn_rad=(0.0, -radians(deg), 0.0))) for deg in _LEANS_DEG),
        *((f"{_PUSH} {force:g} N", Spatial(Law.PUSH, push_N=(force, 0.0))) for force in _PUSHES_N),
        (_DRIVE, Spatial(Law.PUSH, turn_rad=(0.0, 0.0, DRIVE_RAD))),
        *((f"{_STAND} {deg:g} deg", Spatial(Law.PUSH, turn_rad=(0.0, radians(deg), 0.0))) for deg in _STANDS_DEG),
        (_INSERT, Spatial(Law.INSERT)),
        (_WITHDRAW, Spatial(Law.WITHDRAW)),
    )
)
"""What each is in numbers, the same for all shapes: of a corner in the direction of x."""

_ANYWHERE: Final = ("upright", "leaning", "corner")
_BEGINS: Final = {
    _LEAN: _ANYWHERE, _PUSH: ("leaning", "corner"), _DRIVE: ("corner",), _STAND: ("leaning", "corner"),
    _INSERT: ("upright in the hole",), _WITHDRAW: ("upright in the hole", "corner"),
}  # fmt: skip
"""How the names of the situations begin in which a skill may: elsewhere it does nothing, or harm."""


_BY_RULE: Final = {
    ("corner caught", _PUSH): _STAND, ("corner caught", _DRIVE): _STAND, ("corner wedged", _PUSH): _DRIVE,
    ("corner turning", _DRIVE): _PUSH, ("upright in the hole", _INSERT): _WITHDRAW,
}  # fmt: skip
"""What the policy corner-first does next, where that is not plain: by the situation, and by what was done before."""


def may_begin(skill: str, state: str) -> bool:
    """Whether a skill is one for a state, both by name."""
    return state.startswith(_BEGINS[skill.partition(" ")[0]])


def by_rule(skill: str, state: str) -> bool:
    """Whether a skill, of whatever size, is the one that corner-first would take in a state, both by name."""
    situation, _, before = state.removesuffix(" at first").partition(" after ")
    upright = _INSERT if situation == "upright in the hole" else _LEAN
    otherwise = upright if situation.startswith("upright") else _PUSH if before == _LEAN else _LEAN
    return skill.partition(" ")[0] == _BY_RULE.get((situation, before), otherwise)


class Skills:
    """The skill that runs, action by action.

    Args:
        options: Corners and weight of the peg.
        half_width_m: Half the side of the area in which the tip may be.
    """

    def __init__(self, options: SpatialOptions, half_width_m: float) -> None:
        self._options, self._far_m = options, _FAR_SHARE * half_width_m

    def begin_trial(self) -> None:
        """No corner has been tried."""
        self._corner, self._kind, self._tried = Corner(self._options), "", False

    def begin(self, skill: Action, observation: Observation) -> None:
        """This skill runs from now on."""
        corner, spatial = self._corner, skill.spatial or Spatial()
        self._kind, self._spatial = skill.name.partition(" ")[0], spatial
        self._done = self._quiet = 0
        if self._kind == _LEAN:
            corner.take(corner.number + 1 if self._tried else 0)
            corner.lean_rad, self._tried = -spatial.turn_rad[1], True
        elif self._kind == _PUSH:
            corner.push_N = spatial.push_N[0]
        elif self._kind == _DRIVE:
            self._drive_rad = copysign(spatial.turn_rad[2], observation.turn_rad[2])

    def over(self, observation: Observation) -> bool:
        """Whether the skill that runs has come to its end."""
        corner, lean_rad, kind = self._corner, hypot(*observation.turn_rad[:2]), self._kind
        self._done += 1
        if kind == _INSERT or self._done >= LONGEST_PUSH:
            # Whatever came to nothing in as many actions as the longest push has.
            return True
        if kind == _LEAN:
            return corner.over
        if kind == _STAND:
            return lean_rad < UPRIGHT_RAD
        if kind == _WITHDRAW:
            return corner.clear(observation)
        corner_m, tip_m = self._depths_m(observation)
        quiet = min(corner.walls_N(observation)) > WALL_N and abs(observation.torque_Nm[2]) < QUIET_NM
        self._quiet = self._quiet + 1 if quiet else 0
        if kind == _DRIVE and tip_m <= CAUGHT_M:
            return self._done >= 2 * DRIVEN_ACTIONS
        slipped = corner.passed(observation) or (self._done > 2 and corner_m < ON_PLATE_M)
        return self._quiet >= QUIET_ACTIONS or slipped

    def step(self, observation: Observation) -> tuple[tuple[float, float], Spatial]:
        """The next action of the skill: its displacement in m, (2,), and all else."""
        corner, kind, none = self._corner, self._kind, (0.0, 0.0)
        if kind == _LEAN:
            # What is in the hole is drawn out of it first; a lift would pull against what holds it.
            held = not corner.leaned and self._depths_m(observation)[0] > ON_PLATE_M
            return (none, corner.withdrawing(observation)) if held else corner.leaning(observation)
        if kind == _PUSH:
            return self._pushed(observation)
        if kind == _DRIVE:
            yaw_rad = self._drive_rad if self._done < DRIVEN_ACTIONS else -self._drive_rad
            yaw_rad = 0.0 if self._depths_m(observation)[1] > CAUGHT_M else yaw_rad
            displacement_m, spatial = self._pushed(observation)
            return displacement_m, replace(spatial, turn_rad=(0.0, 0.0, yaw_rad))
        if kind == _STAND:
            lean_rad = max(hypot(*observation.turn_rad[:2]), 1e-9)
            return none, self._pushed(observation, min(1.0, self._spatial.turn_rad[1] / lean_rad))[1]
        if kind == _WITHDRAW:
            return none, corner.withdrawing(observation)
        return none, self._spatial

    def facts(self, observation: Observation) -> tuple[float, ...]:
        """What situations are told apart by, as :data:`palpate.core.perception.FACTS` has it."""
        lean_rad, depths_m = hypot(*observation.turn_rad[:2]), self._depths_m(observation)
        return lean_rad, *depths_m, min(self._corner.walls_N(observation)), observation.torque_Nm[2]

    def _depths_m(self, observation: Observation) -> tuple[float, float]:
        """Of the lowest corner, and of the tip: as if it had been let down as far as it goes."""
        corner, lean_rad, depth_m = self._corner, hypot(*observation.turn_rad[:2]), observation.depth_m
        corner_m = depth_m + corner.radius_m * sin(lean_rad)
        if lean_rad < Situations.upright_rad:
            return corner_m, depth_m
        return corner_m, corner_m - corner.down_m + HANGS_M + CAUGHT_M

    def _pushed(self, observation: Observation, upright: float = 0.0) -> tuple[tuple[float, float], Spatial]:
        x, y, _ = observation.reference_m
        spatial = self._corner.pushing(observation, upright)
        if x * spatial.push_N[0] + y * spatial.push_N[1] > self._far_m * hypot(*spatial.push_N):
            return (0.0, 0.0), replace(spatial, push_N=(0.0, 0.0))
        return self._corner.lead_m, spatial


class SkillAgent(Agent):
    """Runs the chosen skill action by action; symbols, states and learning are of whole skills.

    Args:
        skills: Runs them.
    """

    def __init__(
        self, perception: Perception, policy: Policy, reinforcement: Reinforcement, tick_s: float, skills: Skills
    ) -> None:
        super().__init__(perception, policy, reinforcement, tick_s)
        self._skills = skills
        self._began: int

    @override
    def begin(self, trial: int, rng: np.random.Generator) -> None:
        super().begin(trial, rng)
        self._skills.begin_trial()
        self._running: Decision | None = None

    @override
    def _learn_from(self, tick: int, seen: Observation) -> int:
        self._of_the_task = self._skills.facts(seen)
        if self._running is not None and not self._skills.over(seen):
            return seen.state
        if self._pending is not None:
            # An insertion that got stuck took its time though no action ran.
            self._least_ticks = tick - self._began
        self._running, self.goes_on, self._began = None, False, tick
        return super()._learn_from(tick, seen)

    @override
    def _decide(self, observation: Observation) -> Decision:
        if (chosen := self._running) is None:
            chosen = super()._decide(observation)
            if chosen.index is None:
                return chosen
            self._running, self.goes_on = chosen, True
            self._skills.begin(chosen.action, observation)
        displacement_m, spatial = self._skills.step(observation)
        return replace(chosen, action=Action(chosen.action.name, displacement_m, spatial))
