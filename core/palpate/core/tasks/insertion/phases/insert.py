"""The insertion: down the hole until the peg rests on its floor, or is past its depth between walls that respond."""

from enum import Enum
from math import hypot, sqrt
from typing import Final

from typing_extensions import override

from palpate.core.motion import DampingControl
from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, Vector3
from palpate.core.tasks.contact import Monitor, RunningPhase
from palpate.core.tasks.insertion.phases.equipment import Equipment
from palpate.core.trial import ControlConfig, Outcome

_WALL_M: Final = 5e-4
"""Depth at which a wall is looked for first; half the insertion depth where that is less."""
_WALL_SHARE: Final = 0.4
"""The same as a share of the budget, with a stiff gripper: enough is left to find it."""
_DUE_SHARE: Final = 0.5
"""Share of the budget after which one is looked for again."""
_PUSH_M_S: Final = 2e-3
"""A wall is met with less than its push: 40 N/mm times the way of ten ticks of servo lag is 6 N."""
_BEND_M: Final = 1e-4
"""Bend of the gripper under the push, beyond the play."""
_STALL_TICKS: Final = CONTROL_RATE_HZ // 2
_STALL_M: Final = 1e-4
"""An insertion that gains no more depth in that time has met something: at the slowest creep a tenth of a millimetre
takes a third of it."""
_WEDGED_TICKS: Final = 3 * CONTROL_RATE_HZ
"""Six times the stall: the harder press and the looks lie between."""
_SLOWED: Final = 3.0
"""Friction slows the way down to a third of what damping and press give."""
_REST_S: Final = 5.0
"""Time on the way for responses, stalls and harder presses."""
_PAST_FLOOR_M: Final = 3e-4
"""A tip this far below the floor's lowest place has none under it."""
_LOOK_TICKS: Final = 2 * CONTROL_RATE_HZ
"""At depth, until floor or wall responds: five of the longest windows."""
_SEAT_TICKS: Final = CONTROL_RATE_HZ // 2
"""Of the harder press, or of the release."""
_HARDER_SHARE: Final = 0.25
"""Most of the force limit that is added to the press."""
_RELEASE_SHARE: Final = 0.8
"""Pull over press in a release: a peg that came down by the press comes up by more than its friction; one that not even
the harder press moves is held by more."""
_DEVIATIONS: Final = 3.3
"""Of the depth: one in two thousand is further off on one side."""


class Stage(Enum):
    """What an insertion does at present."""

    SINK = "sink"
    LOOK = "look"
    SEAT = "seat"
    RELEASE = "release"


class Insert(RunningPhase):
    """Sinks until the peg is in, on an edge, or wedged. The trial ends here, unless the drop was on an edge."""

    def __init__(self, equipment: Equipment, monitor: Monitor, control: ControlConfig) -> None:
        task, self._equipment, self._monitor = equipment.task, equipment, monitor
        self._state, self._measurement = equipment.state, equipment.measurement
        self._motion, self._law = equipment.motion, equipment.laws.inserting
        self._full_m, self._tolerance_m = task.insertion_depth_mm * 1e-3, task.depth_tolerance_mm * 1e-3
        self._press_N = press_N = task.insertion_press_N
        budget_m = (task.max_force_N - press_N) / monitor.axial_N_per_m
        self._wall_m, self._reach_m = min(_WALL_M, 0.5 * self._full_m, _WALL_SHARE * budget_m), task.reach_m + _BEND_M
        damping = control.damping_N_s_per_m
        self._harder_m_s = min(press_N, _HARDER_SHARE * task.max_force_N) / damping
        self._limit_ticks = (_SLOWED * self._full_m * damping / press_N + _REST_S) * CONTROL_RATE_HZ
        self._pull_N = _RELEASE_SHARE * press_N
        pull = (0.0, 0.0, self._pull_N)
        self._pull = DampingControl(damping, pull, task.travel_speed_mm_s * 1e-3, monitor.axial_N_per_m, PERIOD_S)

    def enter(self) -> None:
        """Begin where the reaction of the plate was lost."""
        self.over, self._stage = False, Stage.SINK
        self._state.hole_tick = self._entered_tick = self._progress_tick = self._state.tick
        self._best_m, self._from_m = 0.0, self._motion.reference_m
        self._walled = self._found = self._released = False
        self._seated_m: float | None = None
        self._stalled_tick: int | None = None
        self._monitor.push(None)
        self._monitor.presses(self._press_N, self._reach_m)
        self._law.reset()

    @override
    def step(self) -> Vector3:
        self._depth_m = depth_m = self._measurement.tip_depth_m - self._state.surface_m
        self._pressed = self._measurement.filtered_force_z_N < -self._monitor.contact_N
        if depth_m > self._best_m + _STALL_M:
            self._best_m, self._progress_tick = depth_m, self._state.tick
        if self._stage is Stage.SEAT:
            return self._seat()
        if self._stage is Stage.RELEASE:
            return self._release()
        unsure_m = self._tolerance_m + self._state.slack_m + self._state.edge_m
        # A tool that may press no further cannot show a floor: it looks for a wall until that responds.
        rests = self._pressed and not self._monitor.spent and depth_m >= self._full_m - unsure_m
        if self._stage is Stage.SINK and (rests or depth_m >= self._full_m + self._tolerance_m):
            self._begin_look()
        return self._look() if self._stage is Stage.LOOK else self._sink()

    def _sink(self) -> Vector3:
        """Sink on, pushing to a wall until it responds, and again when half the budget is spent."""
        state, monitor = self._state, self._monitor
        stalled = state.tick - self._progress_tick
        if stalled > _STALL_TICKS and self._depth_m < self._equipment.drop_m:
            state.event("false drop", f"to {self._best_m * 1e3:.3f} mm")
            state.hole_tick = None
            self.over = True
        elif stalled > _WEDGED_TICKS or state.tick - self._entered_tick > self._limit_ticks:
            self._wedged(f"at {self._depth_m * 1e3:.2f} mm")
        elif stalled > _STALL_TICKS and self._stalled_tick != self._progress_tick and monitor.supported:
            self._stalled_tick = self._progress_tick
            self._begin(Stage.SEAT)
        if monitor.walled:
            state.event("verified", f"wall at {self._depth_m * 1e3:.2f} mm: {monitor.across.text()}")
            self._walled = True
            monitor.push(None)
        due = not self._walled or monitor.spent_N > _DUE_SHARE * monitor.budget_N
        vx, vy, vz = self._pressing(push=due and self._depth_m > self._wall_m)
        if monitor.spent:
            monitor.wait(f"at {self._depth_m * 1e3:.2f} mm in the hole")
            vz = min(vz, 0.0)
        return vx, vy, vz + (monitor.dither_m_s() if self._pressed else 0.0)

    def _wedged(self, text: str) -> None:
        """No more depth is to be gained."""
        self._state.end(Outcome.WEDGED, text)

    def _pressing(self, *, push: bool) -> Vector3:
        """Velocity of the pressing law, and across to a wall or to where no force is."""
        reference_m = self._motion.reference_m
        vx, vy, vz = self._law.velocity_m_s(reference_m, reference_m, self._measurement.force_N)
        if push:
            (px, py), (ux, uy) = self._pushing(), self._monitor.direction or (0.0, 0.0)
            # Across the push another wall may press: the law gives way to it.
            aside = vy * ux - vx * uy
            return px - aside * uy, py + aside * ux, vz
        return (0.0, 0.0, vz) if self._out_of_reach(vx, vy) else (vx, vy, vz)

    def _pushing(self) -> tuple[float, float]:
        """Velocity to a wall: the nearest, by the force across."""
        monitor, (fx, fy, _) = self._monitor, self._measurement.force_N
        if monitor.direction is None:
            size_N = max(hypot(fx, fy), 1e-9)
            monitor.push((-fx / size_N, -fy / size_N))
        ux, uy = monitor.direction or (0.0, 0.0)
        share = min(max(1.0 + (fx * ux + fy * uy) / monitor.push_N, -1.0), 1.0)
        if self._out_of_reach(ux, uy):
            share = min(share, 0.0)
            monitor.wait(f"to a push across at {self._depth_m * 1e3:.2f} mm in the hole")
        along = share * _PUSH_M_S + monitor.push_dither_m_s(met=share < 0.5)
        return along * ux, along * uy

    def _out_of_reach(self, vx: float, vy: float) -> bool:
        """Whether the tip is as far out as a wall can be, and this velocity leads further."""
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
        self._monitor.pull_N = 0.0
        self._monitor.axial.restart()
        self._monitor.push(None)

    def _look(self) -> Vector3:
        """At depth: the floor responds along the axis or, where there is none, a wall across it."""
        monitor, depth_m = self._monitor, self._depth_m
        self._depths_m.append(depth_m)
        # A pull that a wrong scale makes larger would draw the tip deeper than the encoders say.
        least_m = min(depth_m, self._measurement.position_m[2] - self._state.surface_m)
        past = least_m > self._full_m + self._tolerance_m + self._state.slack_m + _PAST_FLOOR_M
        free = past and not self._pressed
        if monitor.spent and not self._pressed and not past:
            # The way used up what it could press with: a wall comes first.
            self._begin(Stage.SINK)
            return self._sink()
        response = monitor.across if free else monitor.axial
        if past and self._pressed:
            monitor.mismatch(f"a floor at {depth_m * 1e3:.2f} mm, deeper than it can be")
        elif (not free or monitor.direction is not None) and response.verified_since_restart():
            self._judge(response.window)
        elif len(self._depths_m) > _LOOK_TICKS:
            monitor.mismatch(f"no floor and no wall responds at {depth_m * 1e3:.2f} mm")
        else:
            # A peg that still sinks against friction responds as no spring does.
            sinking = self._state.tick - self._progress_tick <= response.window
            monitor.wait(f"at {depth_m * 1e3:.2f} mm in the hole", supported=self._pressed and not sinking)
        vx, vy, vz = self._pressing(push=free)
        vz = min(vz, 0.0) if past or monitor.spent else vz
        return vx, vy, vz + (monitor.dither_m_s() if self._pressed else 0.0)

    def _judge(self, window: int) -> None:
        """Is it deep enough, for all that is not known of its depth?"""
        state, seen_m = self._state, self._depths_m[-window:]
        depth_m, error_m = sum(seen_m) / len(seen_m), self._deviation_m(len(seen_m))
        tilt_m = 0.5e-3 * self._equipment.task.end_tilt_mm
        short_m = self._full_m - self._tolerance_m - (depth_m - tilt_m - _DEVIATIONS * error_m)
        text = f"depth {depth_m * 1e3:.3f} mm, standard deviation {error_m * 1e3:.3f} mm"
        if short_m <= 0.0 or self._released:
            state.event("verified", f"{text}: {self._monitor.axial.text()}")
            state.end_inserted(depth_m)
        elif self._seated_m is None or depth_m > self._seated_m + max(4.0 * error_m, _STALL_M):
            # It may still sink under a harder press.
            self._seated_m = depth_m
            state.event("short", f"{text}: pressed harder")
            self._begin(Stage.SEAT)
        elif short_m <= state.slack_m + state.edge_m + 2.0 * _DEVIATIONS * error_m:
            self._text, self._monitor.pull_N = text, self._pull_N
            self._begin(Stage.RELEASE)
        else:
            self._wedged(f"{text}, {short_m * 1e3:.3f} mm short")

    def _deviation_m(self, samples: int) -> float:
        """Standard deviation of the depth between floor and surface."""
        step_m, noise_m = self._measurement.depth_step_m, self._state.noise[2] / self._monitor.axial_N_per_m
        tilt_m = 1e-3 * self._equipment.task.end_tilt_mm
        # Tilt and an untouched surface are uniform in their ranges.
        uniform = (tilt_m * tilt_m + 4.0 * self._state.slack_m * self._state.slack_m) / 12.0
        return sqrt(2.0 * (step_m * step_m + noise_m * noise_m / samples) + uniform)

    def _seat(self) -> Vector3:
        """Press harder, with a wobble, and then look or sink on."""
        monitor, (vx, vy, vz) = self._monitor, self._pressing(push=False)
        self._ticks += 1
        if self._ticks > _SEAT_TICKS or monitor.contradicted:
            if self._found:
                self._begin_look()
            else:
                self._begin(Stage.SINK)
        return vx + monitor.push_dither_m_s(), vy, vz + self._harder_m_s + monitor.dither_m_s()

    def _release(self) -> Vector3:
        """Pull gently: a peg on the floor comes up, one that is wedged does not. Then press and look again."""
        self._ticks += 1
        reference_m = self._motion.reference_m
        if self._seated_m is not None and self._depth_m < self._seated_m - 2.0 * _STALL_M:
            self._released = True
            # It sinks back to the floor.
            self._best_m, self._progress_tick = self._depth_m, self._state.tick
            self._begin_look()
        elif self._ticks > _SEAT_TICKS:
            self._state.end(Outcome.UNCERTAIN_DEPTH, self._text)
        return 0.0, 0.0, self._pull.velocity_m_s(reference_m, reference_m, self._measurement.force_N)[2]
