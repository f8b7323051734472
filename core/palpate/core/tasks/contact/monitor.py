"""The contact monitor: has the force sensor recently shown what the motion must cause, and how far may the tool go?"""

from __future__ import annotations

from dataclasses import replace
from math import hypot
from operator import sub
from typing import Final

from palpate.core.job import AXIAL, FAIR, NARROW, Spring
from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, STILL, Snapshot, Vector3
from palpate.core.tasks.contact.dither import Dither
from palpate.core.tasks.contact.response import Response, Verdict
from palpate.core.tasks.contact.trial_state import TrialState
from palpate.core.trial import (
    N_PER_KGF,
    ControlConfig,
    Measurement,
    Purpose,
    TaskConfig,
    TrialSetup,
    Trip,
    TripReason,
    generator,
)

_PATIENCE_TICKS: Final = CONTROL_RATE_HZ
"""Stationary, until the force responds: two of the longest windows."""
_ACROSS: Final = (0.2, 1.5)
"""Across, tilt of the peg, friction along a wall and coarse encoders lower what is measured: to 0.24 at the least in
trials without a fault. A sensor that shows a tenth of the force is outside."""
_PUSH_N: Final = 3.0
"""Force of a push against a wall: the response to half of it is narrow with a noise of 0.3 N."""
_GROWTH: Final = 1.02
"""Of the push in each tick in which a wall is felt and the response is unknown: doubled in a quarter of a second."""
_PUSH_SHARE: Final = 0.25
"""Bend of the gripper by a push, over the budget, from which it grows no more: with as much again, and what grows until
that is seen, it stays below the budget."""
_FOLLOWED: Final = 2.0
"""Largest command over that bend: servos that follow by less than half are late as well, and would swing."""
_AIMED: Final = 0.85
"""Cosine of the widest angle between a push and a wall's force: 0.7 of the wall's stiffness responds."""
_SIMILAR: Final = 0.5
"""Cosine of the widest angle between pushes of one kind: wall by wall into a corner."""
_ANGULAR_PER_S: Final = 90.0
"""Of a dither with half-periods of five ticks."""
_TOUCH_SHARE: Final = 0.15
"""A force below this share of the press is none of a contact's: half the dither's amplitude."""
_PULL_SHARE: Final = 0.5
"""A pull above this share of the press, and friction, is none of a contact's: less than a peg rebounds with."""
_SAMPLES: Final = 4
"""Samples in a row that an implausible wrench lasts: more than an impact."""
_TILT_RAD: Final = 6e-3
"""Orientation error of arm and grip that no job states: servos sag by up to 8 mrad and are put upright from there."""
_NOISES_TORQUE: Final = 3.0
"""Standard deviations of a torque about the tip: four samples in a row exceed them once in 70 million."""
PAST_PLATE_M: Final = 1e-3
"""A tip this far below the lowest possible plate is not on it; an approach overshoots by less."""


class Monitor:
    """Dither, response and budget of a trial, along the tool axis and across it.

    The budget is the force by which the gripper may bend, unseen by a faulty sensor, since the last verification.

    Args:
        step_m: Standard deviation of the tip's place by the encoders.
        turns_rad: Angle by which the tool itself tilts in a hole; 0 for one that does not turn, nor dithers in air.

    Attributes:
        axial: Response along the tool axis.
        air: The same of a tool that touches nothing, by its inertia; only where it dithers in air.
        loose: The same of one that touches at times; only there, too.
        across: Response along a push.
        direction: Of the push, (2,); None without one.
        spent_N: Bend of the gripper since the last verification, if the tip had not moved but by the play.
        spent: Whether that was more than the budget: the tool may go no further until the force responds.
        budget_N: Largest one.
        play_m: Way across that bends nothing.
        patience_ticks: On the spot, before a mismatch is reported.
        pull_N: By which the tool itself pulls.
        axial_N_per_m, lateral_N_per_m: Stiffness of the gripper along the tool axis and across it.
    """

    def __init__(
        self, state: TrialState, task: TaskConfig, control: ControlConfig, step_m: float, *, turns_rad: float = 0.0
    ) -> None:
        self._state, self._step_m = state, step_m
        self.axial_N_per_m = control.axial_stiffness_N_per_mm * 1e3
        self.lateral_N_per_m = control.lateral_stiffness_N_per_mm * 1e3
        self.press_N, self.contact_N = task.press_kgf * N_PER_KGF, task.contact_kgf * N_PER_KGF
        self._slack_m, self._friction = task.surface_uncertainty_mm * 1e-3, task.friction
        self.deepest_plate_m = self._slack_m + PAST_PLATE_M
        bent_rad = _TILT_RAD + task.tilt_mrad * 1e-3 + turns_rad
        self._bent_Nm = self._torque_Nm = bent_rad * control.tilt_stiffness_Nm_per_rad
        self._lever_m = task.lever_mm * 1e-3
        in_air = turns_rad > 0.0
        self._max_force_N = task.max_force_N
        self.presses(task.press_kgf * N_PER_KGF)
        self.axial, self.across = (
            Response(Spring(stiffness, control.damping_s(stiffness), control.rigid_mass_kg, *accepted))
            for stiffness, accepted in ((self.axial_N_per_m, AXIAL), (self.lateral_N_per_m, _ACROSS))
        )
        self.patience_ticks = _PATIENCE_TICKS
        mass_kg = control.moving_mass_kg + control.rigid_mass_kg
        self.air = Response(Spring(0.0, 0.0, mass_kg, *AXIAL)) if in_air else None
        # A wider choice of responses asks for narrower ones.
        self._fair = NARROW if in_air else FAIR
        self.loose = Response(replace(self.axial.spring, lowest=_ACROSS[0])) if in_air else None
        self._unloaded = tuple(response for response in (self.air, self.loose) if response is not None)
        speed_m_s = task.travel_speed_mm_s * 1e-3
        self._dither, self._push_dither = Dither(0.0, speed_m_s), Dither(0.0, speed_m_s)

    def begin(self, setup: TrialSetup) -> None:
        """Begin a trial."""
        rng = generator(setup.seed, Purpose.DITHER, setup.index)
        self._dither.begin(rng)
        self._push_dither.begin(rng)
        self._tared = self.touched = False
        self._sequence: int | None = None
        self._waited_tick = 0
        self.direction: tuple[float, float] | None = None
        self._pulls = self._misfits = 0
        self.pull_N = 0.0
        self._rests_m, self._deepest_m = (0.0, 0.0), 0.0
        self._still_ticks = self._sunk_ticks = 0
        self.presses(self.press_N)
        self.free()

    def _adapt(self, tip_lever_m: float) -> None:
        """Choose amplitudes by the noise while the sensor was tared, at this distance from the tip."""
        noise_N, dither = self._state.noise[2], self._dither
        noise_Nm = hypot(max(self._state.noise[3:5]), tip_lever_m * max(self._state.noise[:2]))
        self._torque_Nm = self._bent_Nm + _NOISES_TORQUE * noise_Nm
        self._contact_m = self.axial.spring.dither_N(self.press_N, noise_N, self._step_m) / self.axial_N_per_m
        dither.amplitude_m = self._air_m = self._contact_m
        self.axial.begin(noise_N, self._step_m, dither.usual_m(self._contact_m) * self.axial_N_per_m)
        if self.air is not None and self.loose is not None:
            inertia_N_per_m = self.air.spring.rigid_kg * _ANGULAR_PER_S**2
            least_N = self.air.spring.least_dither_N(noise_N, self._step_m)
            self._air_m = max(self._contact_m, least_N / inertia_N_per_m)
            self.air.begin(noise_N, self._step_m, dither.usual_m(self._air_m) * inertia_N_per_m)
            self.loose.begin(noise_N, self._step_m, dither.usual_m(self._contact_m) * self.axial_N_per_m)
            # A window where it waits, one where it is raised, one more, and a tenth of a second to begin each.
            self.patience_ticks = max(_PATIENCE_TICKS, 3 * (self.air.window + CONTROL_RATE_HZ // 10))
        least_N = max(0.5 * _PUSH_N, self.across.spring.least_dither_N(max(self._state.noise[:2]), self._step_m))
        self._least_push_m = min(least_N, _PUSH_SHARE * self.budget_N) / self.lateral_N_per_m
        self._dithers_N = 2.0 * (self._air_m * self.axial_N_per_m + _PUSH_SHARE * self.budget_N)

    def presses(self, press_N: float, play_m: float = 0.0) -> None:
        """The tool presses with this force from now on: with it, the gripper's force stays below the limit."""
        self.budget_N, self.play_m = self._max_force_N - press_N, play_m

    def free(self) -> None:
        """The force has responded, or the tool is where it meets nothing: the budget counts from here."""
        self._from_m: Vector3 | None = None
        self.spent_N, self.spent, self._waited_ticks, self._aimed = 0.0, False, 0, False
        self._spent_at_N = 0.0
        for response in self._unloaded:
            response.stationary_ticks = 0

    def _bend_N(self, reference_m: Vector3) -> float:
        """Bend of the gripper at this reference, if the tip stayed where the force last responded."""
        if self._from_m is None:
            self._from_m = reference_m
        x, y, z = map(sub, reference_m, self._from_m)
        across_N = max(hypot(x, y) - self.play_m, 0.0) * self.lateral_N_per_m
        return hypot(across_N, z * self.axial_N_per_m)

    def bounded(self, velocity_m_s: Vector3) -> Vector3:
        """Return the velocity; of one that bends the gripper further than the budget and the dithers, nothing.

        The tool then waits, so that no motion without a response lasts for ever.
        """
        if not self._tared:
            return velocity_m_s
        x, y, z = (at + velocity * PERIOD_S for at, velocity in zip(self._reference_m, velocity_m_s, strict=True))
        most_N = max(self.budget_N, self._spent_at_N) + self._dithers_N
        if self._bend_N((x, y, z)) <= most_N:
            return velocity_m_s
        self.wait("before the tool may go further")
        return STILL

    def check(self, snapshot: Snapshot, measured: Measurement, reference_m: Vector3, *, tared: bool) -> Trip | None:
        """Take in a tick of any phase; return a trip for a wrench that no contact at the tip can cause.

        Args:
            reference_m: Where the tip is commanded to be, (3,), task frame.
        """
        wrench, joints_ns, (x, y, z) = snapshot.wrench, snapshot.joints.source_time_ns, measured.position_m
        new, self._sequence = wrench.sequence != self._sequence, wrench.sequence
        if not tared:
            return None
        if not self._tared:
            self._tared = True
            self._adapt(measured.tip_lever_m)
            self.push(None)
        self._reference_m, self.spent_N = reference_m, self._bend_N(reference_m)
        if self.spent_N > self.budget_N and not self.spent:
            # A tool that waits there goes on to dither, along the axis and across.
            self.spent, self._spent_at_N = True, self.spent_N
        self.axial.add_place(joints_ns, z)
        self._still_ticks += 1
        self._sunk_ticks += 1
        if hypot(x - self._rests_m[0], y - self._rests_m[1]) > self._contact_m:
            # On the chamfer or the edge of a hole it also moves along the axis, without a force.
            self._rests_m, self._still_ticks = (x, y), 0
        if z > self._deepest_m + self._contact_m:
            # So it does where it sinks against friction.
            self._deepest_m, self._sunk_ticks = z, 0
        if self.direction is not None:
            ux, uy = self.direction
            self.across.add_place(joints_ns, x * ux + y * uy)
        if not new:
            return None
        fx, fy, fz = measured.force_N
        touch_N = max(_TOUCH_SHARE * self.press_N, 4.0 * self._state.noise[2])
        if fz > -touch_N:
            self.axial.restart()
        else:
            self.touched = True
        # Filtered, because the inertia of a heavy tool is as large as a contact. Nothing limits the dither of a tool
        # that touches nothing, and inertia responds less than a spring.
        in_air = measured.filtered_force_z_N > -touch_N
        self._dither.amplitude_m = self._air_m if in_air else self._contact_m
        if self.air is not None and not in_air:
            self.air.restart()
        self.axial.add_force(wrench.source_time_ns, fz)
        for response in self._unloaded:
            response.add_place(joints_ns, z)
            response.add_force(wrench.source_time_ns, fz)
            response.lag = self.axial.lag if response.lag is None else response.lag
        if self.direction is not None:
            self.across.add_force(wrench.source_time_ns, fx * ux + fy * uy)
        if self.verified:
            self.free()
        return self._implausible(snapshot.tick, measured)

    def _implausible(self, tick: int, measured: Measurement) -> Trip | None:
        """A wrench that no contact at the tip can cause, in several samples in a row."""
        x, y, z = measured.force_N
        torque_Nm = measured.torque_across_at_tip_Nm
        # Two walls that pinch a tilted peg cancel in the force, and show in the torque.
        walls_N = hypot(x, y) + 2.0 * torque_Nm / self._lever_m
        pull_N = _PULL_SHARE * self.press_N + self.pull_N + self._friction * walls_N
        self._pulls = self._pulls + 1 if z > pull_N else 0
        limit_Nm = self._torque_Nm + self._lever_m * measured.force_norm_N
        self._misfits = self._misfits + 1 if torque_Nm > limit_Nm else 0
        if self._pulls >= _SAMPLES:
            text = f"the force sensor shows a pull of {z:.2f} N, at most {pull_N:.2f} N is possible"
            return Trip(TripReason.PULLED, tick, text)
        if self._misfits >= _SAMPLES:
            text = (
                f"torque about the tip {torque_Nm:.3f} N m, at most {limit_Nm:.3f} N m with this force:"
                " a channel of the force sensor is dead, swapped or wrong"
            )
            return Trip(TripReason.TORQUE_WITHOUT_FORCE, tick, text)
        return None

    def dither_m_s(self) -> float:
        """Return the dither's velocity along the axis, for a tool that presses."""
        return self._dither.velocity_m_s()

    @property
    def push_N(self) -> float:
        """Force of a push, twice that of its dither."""
        dither_N = self._push_dither.amplitude_m * self.lateral_N_per_m
        return 2.0 * min(dither_N, _PUSH_SHARE * self.budget_N)

    def push_dither_m_s(self, *, met: bool = False) -> float:
        """Return the dither's velocity along a push.

        Args:
            met: A wall is felt: the push grows until it responds, by what the flange moves: the arm's own servos give
                way to a stiff gripper.
        """
        largest_m, dither = _PUSH_SHARE * self.budget_N / self.lateral_N_per_m, self._push_dither
        if met and self.across.swing_m < largest_m and dither.amplitude_m < _FOLLOWED * largest_m:
            dither.amplitude_m *= _GROWTH
        return self._push_dither.velocity_m_s()

    def push(self, direction: tuple[float, float] | None) -> None:
        """Push in this direction, (2,), of length 1, from now on, or no longer; a similar push keeps its response."""
        (ux, uy), (vx, vy) = direction or (0.0, 0.0), self.direction or (0.0, 0.0)
        if ux * vx + uy * vy > _SIMILAR:
            return
        self.direction = direction
        self._push_dither.amplitude_m = self._least_push_m
        dither_N = self._push_dither.usual_m(self._least_push_m) * self.lateral_N_per_m
        self.across.begin(max(self._state.noise[:2]), self._step_m, dither_N, self.axial.lag)

    def aim(self, force_N: tuple[float, float]) -> None:
        """Push against this force across of a tool that waits, unless a push is against it, or has not had its window.

        Along a wall nothing responds.
        """
        (fx, fy), (ux, uy) = force_N, self.direction or (0.0, 0.0)
        size_N = hypot(fx, fy)
        if -(fx * ux + fy * uy) < _AIMED * size_N and (not self._aimed or self.across.share is not None):
            self._aimed = True
            self.push((-fx / size_N, -fy / size_N))

    @property
    def verified(self) -> bool:
        """Whether the force responds, along the axis or along a push."""
        along = self.axial.verdict()
        live = self.walled or (self.loose is not None and self.loose.verdict(self._fair) is Verdict.VERIFIED)
        live = live or (self.air is not None and self.air.verdict() is Verdict.VERIFIED)
        return along is Verdict.VERIFIED or (live and not (self.contradicted and self._sunk_ticks > self.axial.window))

    @property
    def walled(self) -> bool:
        """Whether a wall responds to a push."""
        return self.direction is not None and self.across.verdict(self._fair) is Verdict.VERIFIED

    @property
    def supported(self) -> bool:
        """Whether the tool rests on something that responds as the gripper's spring does."""
        return self.axial.verdict() is Verdict.VERIFIED

    @property
    def contradicted(self) -> bool:
        """Whether the response along the axis is none of the gripper's."""
        return self.axial.verdict() is Verdict.CONTRADICTED

    @property
    def waited_share(self) -> float:
        """Share of its patience that the tool has waited."""
        return self._waited_ticks / self.patience_ticks

    def moves_on(self) -> None:
        """The tool follows the force: only one on the spot shows across, or where it touches at times, the converse."""
        self.across.restart()
        if self.loose is not None:
            self.loose.restart()

    def wait(self, where: str, *, supported: bool = False) -> None:
        """Account for a tick on the spot; report a mismatch after too many, or after a window that contradicts.

        Args:
            supported: The tool presses on something that does not give way.
        """
        if self._state.tick > self._waited_tick:
            self._waited_tick = self._state.tick
            self._waited_ticks += 1
        still_ticks = min(self._waited_ticks, self._still_ticks)
        self.axial.widen(still_ticks)
        self.across.widen(still_ticks)
        for response in self._unloaded:
            response.stationary_ticks = still_ticks
        if self.verified:
            self.free()
        contradicted = supported and self.contradicted and still_ticks > self.axial.window + 2
        if contradicted or self._waited_ticks > self.patience_ticks:
            self.mismatch(f"the force does not respond {where}")

    def mismatch(self, text: str) -> None:
        """Report that the force cannot be trusted; the supervisor takes over."""
        measured = f"stiffness along the axis {self.axial.text()}"
        if self.direction is not None:
            measured += f"; across it {self.across.text()}"
        reason = TripReason.CONTACT_MISMATCH if self.touched else TripReason.PLATE_NOT_FELT
        self._state.doubt(Trip(reason, self._state.tick, f"{text}: {measured}"))
