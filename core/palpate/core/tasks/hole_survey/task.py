"""The task: at each place the plate's height, the hole, its floor, its wall all round; and what came of it."""

from collections.abc import Callable, Generator
from enum import Enum
from math import cos, hypot, inf, sin, tau
from typing import Final

from typing_extensions import override

from palpate.core.motion import PositionControl, TipMotion, limited
from palpate.core.ports import PERIOD_S, STILL, Vector3
from palpate.core.tasks.contact import PAST_PLATE_M, ContactProof, RunningPhase, TouchTask, TrialState
from palpate.core.tasks.hole_survey.circle import Circle, fit_circle
from palpate.core.tasks.hole_survey.estimate import Sized, difference_of, mean_of, student_t
from palpate.core.tasks.hole_survey.options import SurveyOptions
from palpate.core.tasks.hole_survey.probe import Motion, Place, Probe, WallTouch
from palpate.core.tasks.hole_survey.surveyed_hole import SurveyedHole
from palpate.core.trial import (
    MEASURED,
    ControlConfig,
    Measurement,
    Outcome,
    TaskConfig,
    TrialSetup,
    Trip,
    TripReason,
    options_of,
)

_SEARCH_M_S: Final = 0.005
"""So slow that a sign of life comes before the gripper's springs could be bent too far."""
_IN_HOLE_M: Final = 3e-4
"""A tip so far below the plate's surface is in the hole."""
_ABOVE_M: Final = 1e-3
_LEAST_DEPTH_M: Final = 1e-3
"""What bears the probe less deep is the hole's edge, and no floor."""
_SAME_EDGE_M: Final = 2e-4
_ROUGH_TOUCHES: Final = 4
_ROUGHLY_M: Final = 3e-4
"""A second touch finds the wall no farther off than this, which an arm lags behind, too."""
_WALL_FRICTION: Final = 0.6
"""A wall that is pushed harder than the plate is pressed pulls the heaving probe by more than a plate's rebound."""
Touch = Callable[[Place, float], Generator[Vector3, None, WallTouch]]


class SurveyPhase(Enum):
    """What follows on the tare, at each hole."""

    TRAVEL = "travel"
    PLATE = "plate"
    SEARCH = "search"
    FLOOR = "floor"
    WALL = "wall"


class SurveyTask(TouchTask):
    """A probe that surveys holes, one after another.

    Args:
        task: The settings; the places are ``goal`` and ``more_goals_mm``.
        control: Gains.
        measurement: From snapshots to the task frame.
        motion: From tip velocities to joint commands.

    Raises:
        ConfigurationError: An option or a gain is refused.
    """

    def __init__(self, task: TaskConfig, control: ControlConfig, measurement: Measurement, motion: TipMotion) -> None:
        free = PositionControl(control.position_gain_per_s, task.travel_speed_mm_s * 1e-3, PERIOD_S)
        state, proof = TrialState(), ContactProof(task, control, _WALL_FRICTION)
        super().__init__(task, measurement, motion, free, state, proof)
        self._survey = Survey(self, task, Probe(task, control, measurement, motion, state, proof), state)

    @override
    def begin(self, setup: TrialSetup) -> None:
        super().begin(setup)
        self._survey.begin()

    @override
    def _follow(self) -> None:
        # The survey enters its own phases as it goes.
        self._running = self._survey

    def enter(self, phase: SurveyPhase) -> None:
        """Another phase of the survey begins; nothing may be touched on the way from place to place."""
        self._enter(phase, self._survey, contact=phase is not SurveyPhase.TRAVEL)


class Survey(RunningPhase):
    """All of the survey, written down as it goes."""

    over = False

    def __init__(self, task: SurveyTask, settings: TaskConfig, probe: Probe, state: TrialState) -> None:
        self._task, self._probe, self._state = task, probe, state
        self._own, self._time_limit_s = options_of(SurveyOptions, settings), settings.time_limit_s
        self._places = [(0.0, 0.0), *settings.more_places_m]
        self._clear_m = -settings.ready_height_mm * 1e-3
        # A tool that turns within a tick seems deeper for that tick, by its inertia.
        self._sunk_ticks = 2 if self._own.unanswered_N else 1
        self._deepest_plate_m = settings.surface_uncertainty_mm * 1e-3 + PAST_PLATE_M

    def begin(self) -> None:
        """A trial begins."""
        self._way, self._ticks = self._all(), 0
        self._probe.begin()

    @override
    def step(self) -> Vector3:
        """The next tick of it."""
        self._ticks += 1
        self._state.report.exploration_time_s = self._ticks * PERIOD_S
        if self._state.report.exploration_time_s >= self._time_limit_s:
            self._state.end(Outcome.TIME_LIMIT, f"{self._time_limit_s:g} s")
            return STILL
        self._probe.watch()
        return next(self._way)

    def _all(self) -> Motion:
        found: list[SurveyedHole] = []
        for number, place in enumerate(self._places, 1):
            hole = yield from self._hole(number, place)
            if hole is not None:
                found.append(hole)
                self._state.event(MEASURED, hole.told())
                self._state.report.depth_m = hole.depth.mm * 1e-3
            yield from self._up()
        worst_mm = max((hole.worst_mm for hole in found), default=0.0)
        whole = len(found) == len(self._places) and worst_mm <= self._own.tolerance_mm
        told = f"{len(found)} of {len(self._places)} holes, each number within {worst_mm:.4f} mm at 95 %"
        self._state.end(Outcome.DONE if whole else Outcome.OUT_OF_TOLERANCE, told)
        while True:
            yield 0.0, 0.0, 0.0

    def _hole(self, number: int, place: Place) -> Generator[Vector3, None, SurveyedHole | None]:
        """One hole."""
        heights = yield from self._plate(place)
        surface_m = mean_of(heights).mm * 1e-3
        self._task.enter(SurveyPhase.TRAVEL)
        yield from self._probe.to((*place, self._clear_m))
        self._task.enter(SurveyPhase.SEARCH)
        yield from self._probe.to((*place, surface_m - _ABOVE_M))
        if not (yield from self._search(place, surface_m)):
            self._state.event(MEASURED, f"hole {number}: not found within {self._own.search_mm:g} mm of its place")
            return None
        self._task.enter(SurveyPhase.FLOOR)
        floor = yield from self._floor(surface_m)
        if not floor:
            self._state.event(MEASURED, f"hole {number}: no floor down to {self._own.deepest_mm:g} mm")
            return None
        self._task.enter(SurveyPhase.WALL)
        depth = difference_of(floor, heights)
        at_m = surface_m + min(0.5 * depth.mm, self._own.wall_depth_mm) * 1e-3
        x, y, diameter = yield from self._wall(at_m)
        return SurveyedHole(number, x, y, diameter, depth, mean_of(heights))

    def _plate(self, place: Place) -> Generator[Vector3, None, list[float]]:
        """The plate's height round a place; the mean of touches all round is that in their middle if it leans."""
        heights: list[float] = []
        for heading in _headings(int(self._own.plate_touches)):
            aside = [at + self._own.aside_mm * 1e-3 * way for at, way in zip(place, heading, strict=True)]
            self._task.enter(SurveyPhase.TRAVEL)
            yield from self._probe.to((aside[0], aside[1], self._clear_m))
            self._task.enter(SurveyPhase.PLATE)
            height = yield from self._probe.below(self._deepest_plate_m)
            heights.append((yield from self._probe.doubt(self._no_plate())) if height is None else height)
            yield from self._up()
        return heights

    def _search(self, place: Place, surface_m: float) -> Generator[Vector3, None, bool]:
        """Down, and where the plate bears the probe, round in a spiral until it does not."""
        probe, turn_m = self._probe, self._own.pitch_mm * 1e-3 / tau
        angle, pressed, sunk_ticks = 0.0, False, 0
        while turn_m * angle <= self._own.search_mm * 1e-3:
            pressed, deep = pressed or probe.bears, probe.depth_m > surface_m + _IN_HOLE_M
            sunk_ticks = sunk_ticks + 1 if deep and not probe.bears else 0
            if sunk_ticks == self._sunk_ticks:
                return True
            vx, vy, vz = probe.yielding_m_s
            if deep or probe.at_edge or not pressed:
                # No farther across the tool as soon as it drops: the filter shows it later, and a wall is near.
                yield from probe.felt((vx, vy, vz))
                continue
            x, y, _ = probe.reference_m
            angle += _SEARCH_M_S * PERIOD_S / (turn_m * hypot(1.0, angle))
            to_x, to_y = place[0] + turn_m * angle * cos(angle), place[1] + turn_m * angle * sin(angle)
            vx, vy, _ = limited(((to_x - x) / PERIOD_S, (to_y - y) / PERIOD_S, 0.0), 2.0 * _SEARCH_M_S)
            yield from probe.felt((vx, vy, vz))
        return False

    def _floor(self, surface_m: float) -> Generator[Vector3, None, list[float]]:
        """Depths at which the floor was touched; none where there is none, or the hole's edge bears the probe twice."""
        depths: list[float] = []
        edge_m = -inf
        while len(depths) < self._own.floor_touches:
            depth = yield from self._probe.below(surface_m + self._own.deepest_mm * 1e-3, felt=True)
            if depth is None:
                return []
            if depth > surface_m + _LEAST_DEPTH_M:
                depths.append(depth)
            elif depth < edge_m - _SAME_EDGE_M:
                yield from self._probe.doubt(self._no_edge(edge_m, depth))
            elif edge_m > -inf:
                return []
            else:
                edge_m = depth
            yield from self._probe.off()
        return depths

    def _wall(self, at_m: float) -> Generator[Vector3, None, tuple[Sized, Sized, Sized]]:
        """All round, first roughly from where the probe came in, then from the middle that these show."""
        x, y, _ = self._probe.reference_m
        probe, touches = self._probe, int(self._own.wall_touches)
        reach_m = (self._own.widest_mm - self._own.probe_mm) * 1e-3
        rough, _ = yield from self._circle(probe.wall, _ROUGH_TOUCHES, (x, y, at_m), reach_m)
        circle, found = yield from self._circle(
            probe.wall_again, touches, (*rough.centre_m, at_m), rough.radius_m + _ROUGHLY_M
        )
        yield from probe.to((*circle.centre_m, at_m), careful=True)
        t = student_t(touches - 3) * 1e3
        (x, y), (x_sd, y_sd) = circle.centre_m, circle.centre_sd_m
        # All places lie too far out, or in, by what the bend is wrong: of that the circle's scatter shows nothing.
        radius_sd_m = hypot(circle.radius_sd_m, (yield from probe.bend_sd_m(found)))
        diameter = Sized(2e3 * circle.radius_m + self._own.probe_mm, 2.0 * t * radius_sd_m)
        return Sized(x * 1e3, t * x_sd), Sized(y * 1e3, t * y_sd), diameter

    def _circle(
        self, touch: Touch, touches: int, middle_m: Vector3, reach_m: float
    ) -> Generator[Vector3, None, tuple[Circle, list[WallTouch]]]:
        """The circle on which the probe's centre stands as it touches the wall from there, all round."""
        found: list[WallTouch] = []
        for heading in _headings(touches):
            yield from self._probe.to(middle_m, careful=True)
            found.append((yield from touch(heading, reach_m)))
        circle = fit_circle(self._probe.places_m(found))
        return circle or (yield from self._probe.doubt(self._no_circle())), found

    def _up(self) -> Motion:
        x, y, _ = self._probe.reference_m
        yield from self._probe.to((x, y, self._clear_m))

    def _no_plate(self) -> Trip:
        text = (
            f"nothing bears the pressing force down to {self._deepest_plate_m * 1e3:.2f} mm below the nominal plane,"
            " where the plate must be above: the plate is elsewhere, or the force sensor is dead"
        )
        return Trip(TripReason.PLATE_NOT_FELT, self._state.tick, text)

    def _no_edge(self, first_m: float, then_m: float) -> Trip:
        text = (
            f"what bears the probe at the hole's edge was {first_m * 1e3:.2f} mm below the nominal plane, and is"
            f" {then_m * 1e3:.2f} mm: the force sensor does not show what there is"
        )
        return Trip(TripReason.FORCE_WITHOUT_SPRING, self._state.tick, text)

    def _no_circle(self) -> Trip:
        text = "the touches of the wall lie on no circle: the force sensor does not show what there is"
        return Trip(TripReason.WALL_NOT_FELT, self._state.tick, text)


def _headings(count: int) -> list[Place]:
    """Unit vectors all round, evenly, from x towards y."""
    return [(cos(tau * n / count), sin(tau * n / count)) for n in range(count)]
