"""The insertion, which lowers the peg until it rests on the floor, or is past its depth and a wall responds."""

from collections.abc import Callable
from enum import Enum
from functools import partial
from math import fsum, hypot, sqrt
from typing import Final

from typing_extensions import override

from palpate.core.job import MOST_SAMPLES
from palpate.core.motion import DampingControl
from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, ZERO_VELOCITY, Vector3
from palpate.core.tasks.contact import Monitor, RunningPhase
from palpate.core.tasks.insertion.phases.equipment import Equipment
from palpate.core.tasks.insertion.phases.force_zero import DEVIATIONS, ForceZero
from palpate.core.trial import ControlConfig, Outcome

_WALL_M: Final = 5e-4
"""Depth for the first wall search; half the insertion depth if that is less."""
_WALL_SHARE: Final = 0.4
"""Maximum fraction of the budget spent before that search with a stiff gripper; the rest is left for the search."""
_DUE_SHARE: Final = 0.5
"""Fraction of the budget after which the search is repeated."""
_PUSH_M_S: Final = 2e-3
"""Push speed. Contact with a wall adds less force than the push: 40 N/mm times ten ticks of servo lag is 6 N."""
_BEND_SHARE: Final = 0.5
"""Gripper deflection in the wall search, divided by the budget; a push adds a quarter to either side."""
_STALL_TICKS: Final = CONTROL_RATE_HZ // 2
_STALL_M: Final = 1e-4
"""Depth that an insertion must gain in ``_STALL_TICKS``; a smaller gain indicates an obstacle. The slowest creep takes
a third of that time."""
_WEDGED_TICKS: Final = 3 * CONTROL_RATE_HZ
"""Six times the stall time, including harder pressing and the checks; it is also added to the time of a descent."""
_SLOWED: Final = 3.0
"""Factor by which friction may slow the descent relative to damping and pressing force."""
_PAST_FLOOR_M: Final = 3e-4
"""Distance below the lowest possible floor beyond which there is no floor."""
_LOOK_TICKS: Final = 2 * CONTROL_RATE_HZ
"""Number of ticks at depth within which floor or wall must respond: five of the longest windows."""
_SEAT_TICKS: Final = CONTROL_RATE_HZ // 2
"""Duration, in ticks, of harder pressing or of the release."""
_HARDER_SHARE: Final = 0.25
"""Maximum increase in the pressing force, divided by the force limit."""
_RELEASE_SHARE: Final = 0.8
"""Pull divided by pressing force during a release. A peg that descended under that force is released by more than its
friction; one that not even harder pressing moves is held more firmly."""
_LIGHT_SHARE: Final = 0.5
"""Light-contact force divided by the pressing force; the dither interrupts a lighter one."""


class Stage(Enum):
    """Insertion stages."""

    SINK = "sink"
    LOOK = "look"
    SEAT = "seat"
    RELEASE = "release"
    HOLD = "hold"
    LET_GO = "let go"


class Insert(RunningPhase):
    """Phase that lowers the peg until it is inserted, on an edge, or wedged; the trial continues after an edge."""

    def __init__(self, equipment: Equipment, monitor: Monitor, control: ControlConfig) -> None:
        task, self._equipment, self._monitor = equipment.task, equipment, monitor
        self._state, self._measurement = equipment.state, equipment.measurement
        self._motion, self._controller = equipment.motion, equipment.controllers.inserting
        self._full_m, self._tolerance_m = task.insertion_depth_mm * 1e-3, task.depth_tolerance_mm * 1e-3
        self._press_N = press_N = task.insertion_press_N
        budget_N = task.max_force_N - press_N
        self._wall_m = min(_WALL_M, 0.5 * self._full_m, _WALL_SHARE * budget_N / monitor.axial_N_per_m)
        self._play_m, self._chamfer_m = task.play_mm * 1e-3, task.chamfer_mm * 1e-3
        self._bend_m = _BEND_SHARE * budget_N / monitor.lateral_N_per_m
        self._reach_m = self._play_m + self._chamfer_m + self._bend_m
        damping = control.damping_N_s_per_m
        self._harder_m_s = min(press_N, _HARDER_SHARE * task.max_force_N) / damping
        windows = self._full_m * monitor.axial_N_per_m / (_DUE_SHARE * budget_N)
        descent_ticks = _SLOWED * self._full_m * damping / press_N * CONTROL_RATE_HZ
        self._limit_ticks = descent_ticks + _WEDGED_TICKS + windows * MOST_SAMPLES
        # A slower drift stays below half the budget for the maximum duration of a descent.
        self._zero = ForceZero(equipment, monitor, _DUE_SHARE * budget_N / self._limit_ticks)
        self._pull_N, self._let_go_ticks = _RELEASE_SHARE * press_N, round(task.release_s * CONTROL_RATE_HZ)
        self._stages = {Stage.SEAT: self._seat, Stage.RELEASE: self._release, Stage.HOLD: self._hold}
        self._stages[Stage.LET_GO] = self._let_go
        pull = (0.0, 0.0, self._pull_N)
        self._pull, self._free = (
            DampingControl(damping, force_N, task.travel_speed_mm_s * 1e-3, monitor.axial_N_per_m, PERIOD_S)
            for force_N in (pull, (0.0, 0.0, 0.0))
        )

    def enter(self) -> None:
        """Begin at the position where the plate's reaction force was lost."""
        self.over, self._stage = False, Stage.SINK
        self._state.hole_tick = self._entered_tick = self._progress_tick = self._state.tick
        self._best_m, self._from_m = 0.0, self._motion.reference_m
        self._walled = self._found = self._released = False
        self._side: tuple[float, float] | None = None
        self._seated_m: float | None = None
        self._stalled_tick: int | None = None
        self._zero.enter()
        self._monitor.push(None)
        self._monitor.presses(self._press_N, self._play_m + min(self._chamfer_m, self._bend_m))
        self._controller.reset()

    @override
    def step(self) -> Vector3:
        self._depth_m = depth_m = self._measurement.tip_depth_m - self._state.surface_m
        self._pressed = self._measurement.filtered_force_z_N < -self._monitor.contact_N
        self._zero.update()
        fx, fy, fz = self._measurement.force_N
        size_N = max(hypot(fx, fy), 1e-9)
        if self._side is None or size_N > self._monitor.contact_N + self._equipment.task.friction * abs(fz):
            self._side = -fx / size_N, -fy / size_N
        if depth_m > self._best_m + _STALL_M:
            self._best_m, self._progress_tick = depth_m, self._state.tick
        if (stage := self._stages.get(self._stage)) is not None:
            return stage()
        unsure_m = self._tolerance_m + self._state.slack_m + self._state.edge_m
        deep = depth_m >= self._full_m + (-unsure_m if self._pressed else self._tolerance_m)
        # A tool that must not press further cannot detect a floor: it searches for a wall until one responds.
        if deep and self._stage is Stage.SINK and not self._monitor.spent:
            self._begin_look()
        return self._look() if self._stage is Stage.LOOK else self._sink()

    def _sink(self) -> Vector3:
        """Lower the peg, pushing against a wall until it responds; push again once half the budget is spent."""
        state, monitor = self._state, self._monitor
        stalled = state.tick - self._progress_tick
        if stalled > _STALL_TICKS and self._depth_m < self._equipment.drop_m:
            state.event("false drop", f"to {self._best_m * 1e3:.3f} mm")
            state.hole_tick = None
            if state.claimed:
                self._wedged(f"at {self._depth_m * 1e3:.2f} mm")
            else:
                self.over = True
        elif stalled > _WEDGED_TICKS or state.tick - self._entered_tick > self._limit_ticks:
            self._wedged(f"at {self._depth_m * 1e3:.2f} mm")
        elif stalled > _STALL_TICKS and self._stalled_tick != self._progress_tick and monitor.axial.verified:
            self._stalled_tick = self._progress_tick
            self._begin(Stage.SEAT)
        elif self._pressed and self._zero.due:
            self._begin_hold(partial(self._begin, Stage.SINK))
        if monitor.walled:
            state.event("verified", f"wall at {self._depth_m * 1e3:.2f} mm: {monitor.across.text()}")
            self._walled = True
            monitor.push(None)
            if self._depth_m > self._chamfer_m:
                monitor.play_m = self._play_m
        due = not self._walled or monitor.spent or monitor.spent_N > _DUE_SHARE * monitor.budget_N
        # If contact is lost when the budget is spent, there is nothing to press on: only a wall can respond.
        lost = monitor.spent and not self._pressed
        vx, vy, vz = self._pressing(push=due and (lost or self._depth_m > self._wall_m))
        if monitor.spent:
            monitor.wait(f"at {self._depth_m * 1e3:.2f} mm in the hole")
            vz = min(vz, 0.0)
        return vx, vy, vz + (monitor.dither_m_s() if self._pressed else 0.0)

    def _wedged(self, text: str) -> None:
        """End the trial as wedged, unless the descent may have been feigned by a drift."""
        end = partial(self._state.end, Outcome.WEDGED, text)
        if self._zero.due:
            self._begin_hold(end)
        else:
            end()

    def _pressing(self, *, push: bool) -> Vector3:
        """Return the velocity from the pressing controller, with a push against a wall or zero lateral force."""
        reference_m = self._motion.reference_m
        vx, vy, vz = self._controller.velocity_m_s(reference_m, reference_m, self._measurement.force_N)
        if push:
            (px, py), (ux, uy) = self._pushing(), self._monitor.direction or (0.0, 0.0)
            # Another wall may press perpendicular to the push: the controller complies with it.
            aside = vy * ux - vx * uy
            return px - aside * uy, py + aside * ux, vz
        return (0.0, 0.0, vz) if self._out_of_reach(vx, vy) else (vx, vy, vz)

    def _pushing(self) -> tuple[float, float]:
        """Return the velocity towards a wall, the latest one that pressed against the peg."""
        monitor, (fx, fy, _) = self._monitor, self._measurement.force_N
        monitor.push(self._side)
        ux, uy = monitor.direction or (0.0, 0.0)
        share = min(max(1.0 + (fx * ux + fy * uy) / monitor.push_N, -1.0), 1.0)
        if self._out_of_reach(ux, uy):
            share = min(share, 0.0)
            monitor.wait(f"to a push across at {self._depth_m * 1e3:.2f} mm in the hole")
        along = share * _PUSH_M_S + monitor.push_dither_m_s(met=share < 0.5)
        return along * ux, along * uy

    def _out_of_reach(self, vx: float, vy: float) -> bool:
        """Return True if the tip is as far out as a wall can be and the given velocity points further outward."""
        x, y = self._motion.reference_m[0] - self._from_m[0], self._motion.reference_m[1] - self._from_m[1]
        return hypot(x, y) > self._reach_m and x * vx + y * vy > 0.0

    def _begin(self, stage: Stage) -> None:
        self._stage, self._ticks = stage, 0

    def _begin_look(self) -> None:
        if not self._found:
            self._found = True
            self._state.event("hole", f"found after {self._state.exploration_s:.3f} s")
        self._begin(Stage.LOOK)
        self._depths_m: list[float] = []
        self._too_deep_ticks = 0
        self._monitor.pull_N = 0.0
        self._monitor.axial.restart()
        self._monitor.push(None)

    def _look(self) -> Vector3:
        """Check at depth that the floor responds or, without a floor, that a wall responds."""
        monitor, depth_m = self._monitor, self._depth_m
        self._depths_m.append(depth_m)
        # A pull exaggerated by a wrong scale would suggest a deeper tip than the encoders do.
        least_m = min(depth_m, self._measurement.position_m[2] - self._state.surface_m)
        floor_m = self._full_m + self._tolerance_m + self._state.slack_m + _PAST_FLOOR_M
        # Without a response from the floor, a shifted force zero may hide the pressing force.
        past = least_m > floor_m + (0.0 if self._pressed else self._zero.drop_m)
        free = past and not self._pressed
        if monitor.spent and not past and self._measurement.filtered_force_z_N > -_LIGHT_SHARE * self._press_N:
            # The descent has used the budget for pressing: a wall must respond first.
            self._begin(Stage.SINK)
            return self._sink()
        response = monitor.across if free else monitor.axial
        self._too_deep_ticks = self._too_deep_ticks + 1 if past and self._pressed else 0
        if self._too_deep_ticks > response.window:
            monitor.mismatch(f"a floor at {depth_m * 1e3:.2f} mm, deeper than it can be")
        elif self._too_deep_ticks:
            # A late force makes the tip of a fast descent seem deeper.
            monitor.wait(f"at {depth_m * 1e3:.2f} mm in the hole")
        elif (not free or monitor.direction is not None) and response.verified_since_restart():
            self._judge(response.window)
        elif len(self._depths_m) > _LOOK_TICKS:
            monitor.mismatch(f"neither a floor nor a wall was verified at {depth_m * 1e3:.2f} mm")
        else:
            # A peg that still sinks against friction does not respond like a spring.
            sinking = self._state.tick - self._progress_tick <= response.window
            monitor.wait(f"at {depth_m * 1e3:.2f} mm in the hole", supported=self._pressed and not sinking)
        vx, vy, vz = self._pressing(push=free)
        vz = min(vz, 0.0) if past or monitor.spent else vz
        return vx, vy, vz + (monitor.dither_m_s() if self._pressed else 0.0)

    def _judge(self, window: int) -> None:
        """Decide whether the depth is sufficient, given its uncertainty."""
        state, seen_m = self._state, self._depths_m[-window:]
        depth_m, error_m = fsum(seen_m) / len(seen_m), self._deviation_m(len(seen_m))
        tilt_m = 0.5e-3 * self._equipment.task.end_tilt_mm
        short_m = self._full_m - self._tolerance_m - (depth_m - tilt_m - DEVIATIONS * error_m)
        text = f"depth {depth_m * 1e3:.3f} mm, standard deviation {error_m * 1e3:.3f} mm"
        same_m = max(4.0 * error_m, _STALL_M)
        # A floor is at the same depth as before the pull, but a wedged peg is now held at a different depth.
        returned = self._released and self._seated_m is not None and depth_m > self._seated_m - same_m
        if short_m <= 0.0 or returned:
            state.event("verified", f"{text}: {self._monitor.axial.text()}")
            self._seated_m, self._same_m = depth_m, same_m
            if self._zero.seen and not self._zero.due:
                self._finish()
            else:
                self._begin_hold(self._finish)
        elif self._released:
            state.end(Outcome.UNCERTAIN_DEPTH, text)
        elif self._seated_m is None or depth_m > self._seated_m + same_m:
            # The peg may sink further under a harder press.
            self._seated_m = depth_m
            state.event("short", f"{text}: pressed harder")
            self._begin(Stage.SEAT)
        elif short_m <= state.slack_m + state.edge_m + 2.0 * DEVIATIONS * error_m:
            self._text, self._monitor.pull_N = text, self._pull_N
            self._begin(Stage.RELEASE)
        else:
            self._wedged(f"{text}, {short_m * 1e3:.3f} mm short")

    def _finish(self) -> None:
        """End the trial as inserted, after a release if one is specified."""
        if self._let_go_ticks:
            self._begin(Stage.LET_GO)
        elif self._seated_m is not None:
            self._state.end_inserted(self._seated_m)

    def _deviation_m(self, samples: int) -> float:
        """Return the standard deviation of the depth from surface to floor."""
        step_m, noise_m = self._measurement.depth_step_m, self._state.noise[2] / self._monitor.axial_N_per_m
        tilt_m = 1e-3 * self._equipment.task.end_tilt_mm
        # The tilt and the height of an untouched surface are uniformly distributed.
        uniform = (tilt_m * tilt_m + 4.0 * self._state.slack_m * self._state.slack_m) / 12.0
        return sqrt(2.0 * (step_m * step_m + noise_m * noise_m / samples) + uniform)

    def _seat(self) -> Vector3:
        """Press harder and wobble, then check again or continue sinking."""
        monitor, (vx, vy, vz) = self._monitor, self._pressing(push=False)
        self._ticks += 1
        if self._ticks > _SEAT_TICKS or monitor.axial.contradicted or monitor.spent:
            if self._found:
                self._begin_look()
            else:
                self._begin(Stage.SINK)
        return vx + monitor.push_dither_m_s(), vy, vz + self._harder_m_s + monitor.dither_m_s()

    def _let_go(self) -> Vector3:
        """Stop pressing. An inserted peg stays in place, but a peg held only by the pressing force rises."""
        self._ticks += 1
        if self._ticks > self._let_go_ticks and self._seated_m is not None:
            risen_m = self._seated_m - self._depth_m
            if risen_m < self._same_m:
                self._state.end_inserted(self._seated_m)
            else:
                self._state.end(Outcome.UNCERTAIN_DEPTH, f"it rose by {risen_m * 1e3:.3f} mm without the press")
        reference_m = self._motion.reference_m
        return 0.0, 0.0, self._free.velocity_m_s(reference_m, reference_m, self._measurement.force_N)[2]

    def _release(self) -> Vector3:
        """Pull gently to release a peg on the floor, but not a wedged one; then press and check again."""
        self._ticks += 1
        reference_m = self._motion.reference_m
        if self._seated_m is not None and self._depth_m < self._seated_m - 2.0 * _STALL_M:
            self._released = True
            # The peg sinks back to the floor.
            self._best_m, self._progress_tick = self._depth_m, self._state.tick
            self._begin_look()
        elif self._ticks > _SEAT_TICKS:
            self._state.end(Outcome.UNCERTAIN_DEPTH, self._text)
        return 0.0, 0.0, self._pull.velocity_m_s(reference_m, reference_m, self._measurement.force_N)[2]

    def _begin_hold(self, after: Callable[[], None]) -> None:
        self._after_hold = after
        self._zero.hold()
        self._begin(Stage.HOLD)

    def _hold(self) -> Vector3:
        """Keep the tool at its depth until the force zero is confirmed."""
        # Without a dither, a response would be pure chance.
        self._monitor.push(None)
        self._monitor.axial.restart()
        if self._zero.confirmed():
            self._progress_tick = self._state.tick
            self._entered_tick += self._zero.ticks
            self._after_hold()
        # The walls are relieved before the force is compared.
        vx, vy, _ = self._pressing(push=False)
        return (vx, vy, 0.0) if self._zero.settling else ZERO_VELOCITY
