"""What a probe does: go somewhere, touch what lies below, touch a wall; each a generator of a velocity a tick."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from math import dist, hypot, inf, sqrt
from statistics import fmean
from typing import Final, Never

from palpate.core.errors import ConfigurationError
from palpate.core.motion import DampingControl, PositionControl, TipMotion
from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, Vector3
from palpate.core.tasks.contact import (
    HIGHEST_SHARE,
    LOWEST_SHARE,
    AnsweredForce,
    ContactProof,
    FeltWay,
    FirstTouch,
    LiftCheck,
    Mean,
    TrialState,
)
from palpate.core.tasks.hole_survey.options import SurveyOptions
from palpate.core.trial import N_PER_KGF, ControlConfig, Measurement, TaskConfig, Trip, TripReason, options_of

_DOWN_M_S: Final = 0.008
_FAST_M_S: Final = 0.005
_SLOW_M_S: Final = 8e-4
"""So slow that a wall of 40 N/mm gives enough samples for its stiffness before the push is there."""
_OFF_WALL_M: Final = 1e-4
_OFF_FLOOR_M: Final = 5e-4
"""Beyond the gripper's bend, so that a touch is over."""
_SLOW_WAY_SHARE: Final = 2.0
"""Over the way that the tool was drawn back: the wall is met on half of it, and gives no more than once more that."""
_FEWEST: Final = 10
"""Samples of a slow touch that show a stiffness."""
_DEVIATIONS: Final = 2.0
"""By so many of its own a stiffness may seem to be another: one in a hundred does in a noise of 0.3 N."""
_LEAST_SHARE: Final = 0.15
"""With less the force does not follow, however unsure that is."""
_WELL: Final = 0.1
"""A share with a larger standard error counts less, by the square."""
_ARRIVED_M: Final = 2e-6
_PRESSED_SHARE: Final = 0.9
_REST_TICKS: Final = 7
"""For the lag of servos and sensor."""
_SAMPLES: Final = 14
_EDGE_SHARE: Final = 0.6
"""Of the pressing force, across the tool: friction gives less."""
_GONE_SHARE: Final = 0.3
"""Of the push at most so much is left away from the wall."""
_FOLLOWED_SHARE: Final = 0.5
"""Of what the gripper's spring gives over a way off a wall, at least so much less pushes then."""
_BORNE_SHARE: Final = 0.25
_BORNE_TICKS: Final = CONTROL_RATE_HZ
"""From half of the pressing force to all of it; without a fault it takes 7 to 27. A force that stays between, as one
does that is scaled after it was tared, would let the tool give way across for ever."""
_LOOK_SAMPLES: Final = 16
_HEAVE_M_S: Final = 0.02
"""The strokes of an uneven heave would be too long with more."""
_SWING_SHARE: Final = 0.5
"""Of the pressing force, at most so much comes and goes with a heave."""
Motion = Generator[Vector3, None, None]
"""A way without a result."""
Place = tuple[float, float]
_NO_FORCE: Final = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class WallTouch:
    """A tool at rest that pushes on a wall.

    Attributes:
        at_m: Its tip by the encoders, (x, y).
        force_N: Force of the wall on it, (x, y).
        share: Stiffness of this touch, as a share of the gripper's; 1 where it was not measured.
        weight: Of the share: 1 where it was measured well.
    """

    at_m: Place
    force_N: Place
    share: float = 1.0
    weight: float = 1.0


class Probe:
    """A tool that touches.

    Args:
        task: The settings; ``press_kgf`` is for what lies below.
        control: Gains, and the gripper's stiffness.
        measurement: From snapshots to the task frame.
        motion: The commanded tip.
        state: Where the trial stands.
        proof: Holds force against position.

    Raises:
        ConfigurationError: An option is refused.
    """

    def __init__(
        self,
        task: TaskConfig,
        control: ControlConfig,
        measurement: Measurement,
        motion: TipMotion,
        state: TrialState,
        proof: ContactProof,
    ) -> None:
        self._measured, self._motion, self._state, self._proof = measurement, motion, state, proof
        axial_N_per_m = control.axial_stiffness_N_per_mm * 1e3
        self._lateral_N_per_m = control.lateral_stiffness_N_per_mm * 1e3
        own = options_of(SurveyOptions, task)
        self._press_N, self._push_N = task.press_kgf * N_PER_KGF, own.push_N
        speed_m_s, pressing = task.travel_speed_mm_s * 1e-3, (0.0, 0.0, -self._press_N)
        self._travel = PositionControl(control.position_gain_per_s, speed_m_s, PERIOD_S)
        self._careful = PositionControl(control.position_gain_per_s, _FAST_M_S, PERIOD_S)
        self._along = DampingControl(control.damping_N_s_per_m, pressing, _DOWN_M_S, axial_N_per_m, PERIOD_S)
        self._give_m_per_N_s = control.force_integral_m_per_N_s
        self._lift = LiftCheck(state, measurement, motion, proof)
        borne_N = _BORNE_SHARE * self._press_N if task.uneven_heave else inf
        even = FeltWay(state, measurement, proof, control, _SWING_SHARE * self._press_N, speed_m_s, borne_N)
        self._felt: AnsweredForce | FeltWay = even
        if own.unanswered_N:
            known = min(speed_m_s, _HEAVE_M_S), own.unanswered_N, own.tool_kg, measurement.depth_step_m
            self._felt = AnsweredForce(state, measurement, control, *known, even, borne_N, _LOOK_SAMPLES, led=True)
        least_N = _FEWEST * _SLOW_M_S * PERIOD_S * self._lateral_N_per_m
        if self._push_N < least_N:
            accepted = f"at least {least_N:.3g} N, or too few samples show the gripper's stiffness"
            raise ConfigurationError("task.options.push_N", self._push_N, accepted)
        self._back_m = self._push_N / self._lateral_N_per_m + _OFF_WALL_M
        self._sink_m = self._press_N / axial_N_per_m + _OFF_FLOOR_M

    def begin(self) -> None:
        """A trial begins."""
        self._felt.begin()

    def watch(self) -> None:
        """A tick begins."""
        self._felt.watch()

    @property
    def depth_m(self) -> float:
        """Depth of the true tip below the nominal plane."""
        return self._measured.tip_depth_m

    @property
    def reference_m(self) -> Vector3:
        """Where the tip is commanded to be, (3,), task frame."""
        return self._motion.reference_m

    @property
    def bears(self) -> bool:
        """Whether something bears the tool, with half of the pressing force or more."""
        return -self._measured.filtered_force_z_N > 0.5 * self._press_N

    @property
    def _sunk_m(self) -> float:
        """What the gripper's spring gives under what bears the tool; nothing under less, which may be noise."""
        borne_N = -self._measured.filtered_force_z_N
        return borne_N / self._measured.axial_N_per_m if borne_N > _BORNE_SHARE * self._press_N else 0.0

    @property
    def at_edge(self) -> bool:
        """Whether more pushes across the tool than friction gives: it has come to the hole's edge, from inside."""
        return self._aside_N > _EDGE_SHARE * self._press_N

    @property
    def yielding_m_s(self) -> Vector3:
        """Velocity, (3,), that keeps the pressing force, or looks for what bears it, and gives way across the tool."""
        x, y, _ = force_N = self._measured.force_N
        z_m_s = self._along.velocity_m_s(self.reference_m, self.reference_m, force_N)[2]
        return self._give_m_per_N_s * x, self._give_m_per_N_s * y, z_m_s

    def to(self, target_m: Vector3, *, careful: bool = False) -> Motion:
        """To a place and no farther, careful where something is near."""
        law = self._careful if careful else self._travel
        while max(abs(a - b) for a, b in zip(self.reference_m, target_m, strict=True)) > _ARRIVED_M:
            yield law.velocity_m_s(self.reference_m, target_m, _NO_FORCE)

    def off(self) -> Motion:
        """Up, until nothing is pressed any more."""
        x, y, z = self.reference_m
        yield from self.to((x, y, z - self._sink_m), careful=True)

    def doubt(self, trip: Trip) -> Generator[Vector3, None, Never]:
        """The supervisor trips in this very tick; without one the trial ends in the next."""
        self._state.doubt(trip)
        while True:
            yield _NO_FORCE

    def felt(self, velocity_m_s: Vector3) -> Motion:
        """A tick of a way on which it is open where something is met, and all the time until the force is felt."""
        yield self._felt.velocity_m_s(velocity_m_s)
        while self._felt.waits:
            yield self._felt.velocity_m_s(_NO_FORCE)

    def below(self, deepest_m: float, *, felt: bool = False) -> Generator[Vector3, None, float | None]:
        """Down until something bears the pressing force, and a lift that shows that the force follows the spring.

        Args:
            deepest_m: The tip goes no deeper, as it is commanded and as far as nothing bears it.
            felt: Whether the way is long enough to do harm with a sensor that died on it.

        Returns:
            Depth of what lies there below the nominal plane; None where there is nothing.
        """
        still_m = deepest_m
        while True:
            borne_ticks = 0
            while -self._measured.filtered_force_z_N < _PRESSED_SHARE * self._press_N:
                if self.reference_m[2] - self._sunk_m > deepest_m:
                    return None
                # Borne, it goes on without a heave, or the lift would begin at any force; but not far.
                if self.bears:
                    still_m = min(still_m, self.reference_m[2] + self._sink_m)
                    borne_ticks += 1
                    if borne_ticks > _BORNE_TICKS:
                        stays = f"{-self._measured.filtered_force_z_N:.1f} N bear the tool and become no more"
                        yield from self.doubt(self._misfit(stays))
                if felt and not (self.bears and self.reference_m[2] < still_m):
                    yield from self.felt(self.yielding_m_s)
                else:
                    yield self.yielding_m_s
            self._lift.begin()
            while (along := self._lift.velocity_m_s()) is not None:
                yield 0.0, 0.0, along
            if self._proof.axial.passed:
                self._state.report.actions += 1
                return self._proof.axial.tip_depth_m
            # Doubted, or contact slipped away before the lift: then once more.
            yield 0.0, 0.0, 0.0

    def wall(self, heading: Place, widest_m: float, *, felt: bool = True) -> Generator[Vector3, None, WallTouch]:
        """Aside until a wall pushes back, wherever it leads along itself; at the end the tip still pushes.

        Args:
            heading: Unit vector.
            widest_m: So far from here there has to be a wall that pushes back.
        """
        begun = self.reference_m
        while self._aside_N < self._push_N:
            if dist(self.reference_m[:2], begun[:2]) > widest_m:
                yield from self.doubt(self._no_wall(widest_m))
            across = heading[0] * _FAST_M_S, heading[1] * _FAST_M_S, 0.0
            if felt:
                yield from self.felt(across)
            else:
                yield across
        return (yield from self._rested())

    def wall_again(self, heading: Place, widest_m: float) -> Generator[Vector3, None, WallTouch]:
        """The same, then off the wall and slowly on to it once more, so that the force is held against the way.

        Args:
            widest_m: So far from here the wall was met before, the gripper's bend not included.
        """
        reach_m = widest_m + self._push_N / self._lateral_N_per_m
        pushed_N = hypot(*(yield from self.wall(heading, reach_m, felt=False)).force_N)
        back_m, most_N = self._back_m, _GONE_SHARE * self._push_N
        yield from self._away(heading, back_m)
        left_N = yield from self._left_N(most_N)
        if most_N < left_N < pushed_N - _FOLLOWED_SHARE * back_m * self._lateral_N_per_m:
            # An arm that is far behind its commands goes on into the wall once the push is there.
            further_m = left_N / self._lateral_N_per_m + _OFF_WALL_M
            yield from self._away(heading, further_m)
            back_m, left_N = back_m + further_m, (yield from self._left_N(most_N))
        if left_N > most_N:
            off = f"{left_N:.2f} N across the tool are left {back_m * 1e3:.2f} mm off the wall"
            yield from self.doubt(self._misfit(off))
        touch = FirstTouch(self._lateral_N_per_m, self._push_N)
        gone_m = 0.0
        while self._aside_N < self._push_N and gone_m < _SLOW_WAY_SHARE * back_m:
            gone_m += _SLOW_M_S * PERIOD_S
            touch.watch(self._state.snapshot, self._along_heading(self._measured.force_N, heading),
                        self._along_heading(self._measured.position_m, heading))  # fmt: skip
            yield heading[0] * _SLOW_M_S, heading[1] * _SLOW_M_S, 0.0
        measured = touch.steady_share(hypot(*self._state.noise[:2]) / sqrt(2.0), _SLOW_M_S)
        share, error = measured or (0.0, 0.0)
        yield from self._known(share, error)
        found = yield from self._rested()
        self._state.report.actions += 1
        return replace(found, share=share, weight=min(1.0, (_WELL / error) ** 2) if error else 1.0)

    def _known(self, share: float, error: float) -> Motion:
        """Trips where a share of the gripper's stiffness is another one, but for its standard error."""
        room = _DEVIATIONS * error
        if not max(LOWEST_SHARE - room, _LEAST_SHARE) <= share <= HIGHEST_SHARE + room:
            shown = f"{share:.2f} of" if share else "no"
            follows = f"the force follows the way with {shown} control.lateral_stiffness_N_per_mm"
            yield from self.doubt(self._misfit(follows))

    def _away(self, heading: Place, way_m: float) -> Motion:
        """Off a wall, and until servos and sensor have come after."""
        x, y, z = self.reference_m
        yield from self.to((x - heading[0] * way_m, y - heading[1] * way_m, z), careful=True)
        for _ in range(_REST_TICKS):
            yield _NO_FORCE

    def _left_N(self, most_N: float) -> Generator[Vector3, None, float]:
        """What pushes across the tool; a mean where it seems to be more than this, for a single sample may be noise."""
        left_N = self._aside_N
        return hypot(*(yield from self._rested()).force_N) if left_N > most_N else left_N

    def places_m(self, touches: Sequence[WallTouch]) -> list[Place]:
        """Centres of the tip, (x, y): by encoders, corrected by the stiffness that all these touches showed.

        That holds the gripper, as it is and not as it was set, and how the wall itself gives.
        """
        stiffness_N_per_m = self._lateral_N_per_m * _share(touches)[0]
        return [
            (touch.at_m[0] + touch.force_N[0] / stiffness_N_per_m, touch.at_m[1] + touch.force_N[1] / stiffness_N_per_m)
            for touch in touches
        ]

    def bend_sd_m(self, touches: Sequence[WallTouch]) -> Generator[Vector3, None, float]:
        """Standard uncertainty of the bend that all these are corrected for, by how their stiffnesses scatter."""
        share, error = _share(touches)
        yield from self._known(share, error)
        return self._push_N / self._lateral_N_per_m / share * error / share

    def _rested(self) -> Generator[Vector3, None, WallTouch]:
        for _ in range(_REST_TICKS):
            yield _NO_FORCE
        x, y, fx, fy = means = Mean(), Mean(), Mean(), Mean()
        while True:
            values = (*self._measured.position_m[:2], *self._measured.force_N[:2])
            counts = [mean.add(value, self._proof.new) for mean, value in zip(means, values, strict=True)]
            if counts[0] >= _SAMPLES:
                return WallTouch((x.value, y.value), (fx.value, fy.value))
            yield _NO_FORCE

    @property
    def _aside_N(self) -> float:
        x, y, _ = self._measured.force_N
        return hypot(x, y)

    @staticmethod
    def _along_heading(vector: Vector3, heading: Place) -> float:
        return vector[0] * heading[0] + vector[1] * heading[1]

    def _no_wall(self, widest_m: float) -> Trip:
        text = (
            f"no wall of the hole answers a push within {widest_m * 1e3:.2f} mm: the hole is wider than"
            " task.options.widest_mm, or the force sensor does not show what there is"
        )
        return Trip(TripReason.WALL_NOT_FELT, self._state.tick, text)

    def _misfit(self, found: str) -> Trip:
        text = f"{found}: the force sensor does not show what there is, or the gripper is another one"
        return Trip(TripReason.FORCE_WITHOUT_SPRING, self._state.tick, text)


def _share(touches: Sequence[WallTouch]) -> tuple[float, float]:
    """Mean of their shares, each by its weight, and its standard error by how these scatter."""
    shares, weights = [touch.share for touch in touches], [touch.weight for touch in touches]
    share = fmean(shares, weights)
    square = sum(weight * (each - share) ** 2 for each, weight in zip(shares, weights, strict=True))
    return share, sqrt(square / (len(touches) - 1) / sum(weights))
