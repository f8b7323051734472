"""Programmed options for a learner, each with its initiation set and termination."""

from dataclasses import replace
from math import copysign, hypot, radians
from typing import Final

import numpy as np
from typing_extensions import override

from palpate.core.perception import Perception
from palpate.core.policy import Action, ControllerKind, Decision, Observation, Policy, Reinforcement, Spatial
from palpate.core.tasks.insertion import Agent
from palpate.core.tasks.insertion_6dof.corner import UPRIGHT_RAD, Corner
from palpate.core.tasks.insertion_6dof.corner_first import DRIVEN_ACTIONS, QUIET_ACTIONS, STAND_SHARE
from palpate.core.tasks.insertion_6dof.options import SpatialOptions

_TILT, _PUSH, _DRIVE, _STAND, _INSERT, _WITHDRAW = KINDS = ("tilt", "push", "drive", "stand", "insert", "withdraw")
_FAR_SHARE: Final = 0.7
"""Maximum distance from the centre to a pushed tool, divided by the area's half-width."""
_TILTS: Final = (1.0, 1.2)
"""Fractions of the tilt. With less tilt, one corner in three or four slips out; with more, it becomes a lever between
its walls."""
_PUSHES: Final = (0.67, 1.0, 1.33)
_STANDS: Final = (1.0, 1.6)
_UNIT: Final = SpatialOptions()
"""Tilt and push for which the options are listed."""
_TILT_RAD: Final = radians(_UNIT.tilt_deg)
_STAND_RAD: Final = STAND_SHARE * _TILT_RAD


OPTIONS: Final = tuple(
    Action(name, (0.0, 0.0), spatial)
    for name, spatial in (
        *(
            (f"{_TILT} {each:g}", Spatial(ControllerKind.LIFT, turn_rad=(0.0, -each * _TILT_RAD, 0.0)))
            for each in _TILTS
        ),
        *((f"{_PUSH} {each:g}", Spatial(ControllerKind.PUSH, push_N=(each * _UNIT.push_N, 0.0))) for each in _PUSHES),
        (_DRIVE, Spatial(ControllerKind.PUSH, turn_rad=(0.0, 0.0, _TILT_RAD))),
        *(
            (f"{_STAND} {each:g}", Spatial(ControllerKind.PUSH, turn_rad=(0.0, each * _STAND_RAD, 0.0)))
            for each in _STANDS
        ),
        (_INSERT, Spatial(ControllerKind.INSERT)),
        (_WITHDRAW, Spatial(ControllerKind.WITHDRAW)),
    )
)
"""Parameters for each option, for a corner in the x direction, the same for all shapes; the settings scale them."""

_ANYWHERE: Final = ("upright", "tilted", "corner")
_INITIATION: Final = {
    _TILT: _ANYWHERE, _PUSH: ("tilted", "corner"), _DRIVE: ("corner",), _STAND: ("tilted", "corner"),
    _INSERT: ("upright in the hole",), _WITHDRAW: ("upright in the hole", "corner"),
}  # fmt: skip
"""Initiation sets, as prefixes of situation names; elsewhere an option is useless or harmful."""


_BY_RULE: Final = {
    ("corner seated", _PUSH): _STAND, ("corner seated", _DRIVE): _STAND, ("corner wedged", _PUSH): _DRIVE,
    ("corner turning", _DRIVE): _PUSH, ("upright in the hole", _INSERT): _WITHDRAW,
}  # fmt: skip
"""The corner-first policy's next option in special cases, by situation and previous option."""


def can_start(option: str, state: str) -> bool:
    """Return True if the initiation set of an option contains a state, given their names."""
    return state.startswith(_INITIATION[option.partition(" ")[0]])


def by_rule(option: str, state: str) -> bool:
    """Return True if an option, of any size, is the one that corner-first would take in a state, given both names."""
    situation, _, before = state.removesuffix(" at first").partition(" after ")
    upright = _INSERT if situation == "upright in the hole" else _TILT
    otherwise = upright if situation.startswith("upright") else _PUSH if before == _TILT else _TILT
    return option.partition(" ")[0] == _BY_RULE.get((situation, before), otherwise)


class OptionRunner:
    """Runner that executes an option action by action.

    Args:
        options: Options for the peg's corners and weight.
        half_width_m: Half the side of the area for the tip.
    """

    def __init__(self, options: SpatialOptions, half_width_m: float) -> None:
        self._options, self._far_m = options, _FAR_SHARE * half_width_m

    def begin_trial(self) -> None:
        """Clear the list of corners already tried."""
        self._corner, self._kind, self._tried = Corner(self._options), "", False

    def begin(self, option: Action, observation: Observation) -> None:
        """Start the given option."""
        corner, spatial = self._corner, option.spatial or Spatial()
        self._kind, self._spatial = option.name.partition(" ")[0], spatial
        self._done = self._quiet = 0
        if self._kind == _TILT:
            corner.take(corner.number + 1 if self._tried else 0)
            corner.tilt_rad, self._tried = radians(self._options.tilt_deg) * -spatial.turn_rad[1] / _TILT_RAD, True
        elif self._kind == _PUSH:
            corner.push_N = self._options.push_N * spatial.push_N[0] / _UNIT.push_N
        elif self._kind == _DRIVE:
            self._side = copysign(1.0, observation.turn_rad[2])

    def terminated(self, observation: Observation) -> bool:
        """Return True if the running option has terminated."""
        corner, tilt_rad, kind = self._corner, hypot(*observation.turn_rad[:2]), self._kind
        self._done += 1
        if kind == _INSERT or self._done >= corner.longest_push:
            # It also terminates without success after the number of actions in the longest push.
            return True
        if kind == _TILT:
            return corner.over(observation)
        if kind == _STAND:
            return tilt_rad < UPRIGHT_RAD
        if kind == _WITHDRAW:
            return corner.clear(observation)
        _, depth, tip, wall, torque = corner.facts(observation)
        self._quiet = self._quiet + 1 if wall > 1.0 and abs(torque) < 1.0 else 0
        if kind == _DRIVE and tip <= 1.0:
            return self._done >= 2 * DRIVEN_ACTIONS
        slipped = corner.passed(observation) or (self._done > 2 and depth < 1.0)
        return self._quiet >= QUIET_ACTIONS or slipped

    def step(self, observation: Observation) -> tuple[tuple[float, float], Spatial]:
        """Return the option's next action: its displacement in m, (2,), and its other parameters."""
        corner, kind, none = self._corner, self._kind, (0.0, 0.0)
        if kind == _TILT:
            # A tool in the hole is withdrawn first; a lift would pull against the walls.
            held = not corner.tilted and corner.facts(observation)[1] > 1.0
            return (none, corner.withdrawing(observation)) if held else corner.tilting(observation)
        if kind == _PUSH:
            return self._pushed(observation)
        if kind == _DRIVE and corner.facts(observation)[2] <= 1.0:
            side = self._side if self._done < DRIVEN_ACTIONS else -self._side
            return self._within(corner.driving(observation, side), observation)
        if kind == _DRIVE:
            return self._pushed(observation)
        if kind == _STAND:
            tilt_rad = max(hypot(*observation.turn_rad[:2]), 1e-9)
            stand_rad = radians(self._options.tilt_deg) * self._spatial.turn_rad[1] / _TILT_RAD
            return none, self._pushed(observation, min(1.0, stand_rad / tilt_rad))[1]
        if kind == _WITHDRAW:
            return none, corner.withdrawing(observation)
        return none, self._spatial

    def facts(self, observation: Observation) -> tuple[float, ...]:
        """Return the situation features, in the order of :data:`palpate.core.perception.FACTS`."""
        return self._corner.facts(observation)

    def _pushed(self, observation: Observation, upright: float = 0.0) -> tuple[tuple[float, float], Spatial]:
        return self._within(self._corner.pushing(observation, upright), observation)

    def _within(self, spatial: Spatial, observation: Observation) -> tuple[tuple[float, float], Spatial]:
        x, y, _ = observation.reference_m
        if x * spatial.push_N[0] + y * spatial.push_N[1] > self._far_m * hypot(*spatial.push_N):
            return (0.0, 0.0), replace(spatial, push_N=(0.0, 0.0))
        return self._corner.lead_m, spatial


class OptionAgent(Agent):
    """Agent that executes its choice action by action; symbols, states and learning apply to whole options.

    Args:
        runner: Runner for the options.
    """

    def __init__(
        self, perception: Perception, policy: Policy, reinforcement: Reinforcement, tick_s: float, runner: OptionRunner
    ) -> None:
        super().__init__(perception, policy, reinforcement, tick_s)
        self._runner = runner
        self._began: int

    @override
    def begin(self, trial: int, rng: np.random.Generator) -> None:
        super().begin(trial, rng)
        self._runner.begin_trial()
        self._running: Decision | None = None

    def _learn_from(self, tick: int, seen: Observation) -> int:
        self._of_the_task = self._runner.facts(seen)
        if self._running is not None and not self._runner.terminated(seen):
            return seen.state
        if self._pending is not None:
            # An insertion that got stuck took time although no action ran.
            self._least_ticks = tick - self._began
        self._running, self.goes_on, self._began = None, False, tick
        return super()._learn_from(tick, seen)

    def _decide(self, observation: Observation) -> Decision:
        if (chosen := self._running) is None:
            chosen = super()._decide(observation)
            if chosen.index is None:
                return chosen
            self._running, self.goes_on = chosen, True
            self._runner.begin(chosen.action, observation)
        displacement_m, spatial = self._runner.step(observation)
        return replace(chosen, action=Action(chosen.action.name, displacement_m, spatial))
