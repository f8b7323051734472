"""The contact monitor, which checks that the force responds to the motion, and limits the motion until it does."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, pi
from operator import sub
from typing import Final

from palpate.core.job import ACROSS, AXIAL, DITHER_SHARE, HALF_PERIOD, MOST_SAMPLES, PUSH_SHARE, Spring
from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, ZERO_VELOCITY, Snapshot, Vector3
from palpate.core.tasks.contact.dither import Dither
from palpate.core.tasks.contact.response import TIMEOUT_TICKS, Response
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

_PUSH_N: Final = 3.0
"""Force for pushing against a wall; the response to half of it has a narrow interval even with 0.3 N of noise."""
_GROWTH: Final = 1.02
"""Push growth per tick against a wall whose response is still unknown: it doubles in a quarter of a second."""
_SIMILAR: Final = 0.5
"""Cosine of the maximum angle between similar pushes, such as those against a corner's two walls."""
_ANGULAR_PER_S: Final = pi / (HALF_PERIOD * PERIOD_S)
"""Angular frequency of a dither with half-periods of mean length."""
_TOUCH_SHARE: Final = 0.5 * DITHER_SHARE
"""Fraction of the pressing force, half the dither's amplitude, below which a force is not a contact."""
_PULL_SHARE: Final = 0.5
"""Fraction of the pressing force, plus friction, above which a pull is implausible; a rebounding peg pulls less."""
_SAMPLES: Final = 4
"""Number of consecutive samples with an implausible wrench; an impact is shorter."""
_TILT_RAD: Final = 6e-3
"""Orientation error from the arm and the grip, which no job specifies; servos sag by up to 8 mrad at the start."""
_NOISES_TORQUE: Final = 3.0
"""Number of standard deviations of a torque about the tip that four consecutive samples exceed once in 70 million."""
_STUCK_SHARE: Final = 2.0
"""Maximum force on a tip stuck anywhere on its path, divided by the force limit; 1.5 misses walls of loose holes."""
PAST_PLATE_M: Final = 1e-3
"""Distance below the lowest possible plate at which the tip cannot be on it; an approach overshoots by less."""


class Monitor:
    """Contact monitor for a trial, with a dither, response and budget along and across the tool axis.

    The budget limits how far the gripper bends between verifications, because a faulty sensor may not show it.

    Args:
        step_m: Standard deviation of the encoder tip position.
        turns_rad: Tool tilt in a hole; 0 for a tool that neither turns nor dithers in air.

    Attributes:
        axial: Response along the tool axis.
        air: Response without contact, from the tool's inertia; only for tools that dither in air.
        loose: Response with intermittent contact; only for the same tools.
        across: Response to a lateral push.
        direction: Push direction, (2,); None if there is no push.
        spent_N: Gripper deflection, as a force, since the last verification, if the tip moved only by the play.
        spent: True if ``spent_N`` exceeds the budget; the tool must not advance until the force responds.
        budget_N: Maximum deflection without verification.
        play_m: Lateral distance that does not bend the gripper.
        waited_ticks: Number of ticks that the tool has spent waiting since the last verification.
        timeout_ticks: Number of stationary ticks before a mismatch is reported.
        pull_N: Pull that the tool itself causes.
        axial_N_per_m, lateral_N_per_m: Gripper stiffness along the tool axis and across it.
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
        # A tool that dithers in air is raised while it waits, which breaks contact.
        longest = MOST_SAMPLES if in_air else TIMEOUT_TICKS
        self._max_force_N, self.spent_N = task.max_force_N, 0.0
        self.presses(task.press_kgf * N_PER_KGF)
        self.axial, self.across = (
            Response(Spring(stiffness, control.damping_s(stiffness), control.rigid_mass_kg, *accepted), longest)
            for stiffness, accepted in ((self.axial_N_per_m, AXIAL), (self.lateral_N_per_m, ACROSS))
        )
        self.timeout_ticks = TIMEOUT_TICKS
        mass_kg = control.moving_mass_kg + control.rigid_mass_kg
        self.air = Response(Spring(0.0, 0.0, mass_kg, *AXIAL)) if in_air else None
        self.loose = Response(replace(self.axial.spring, lowest=ACROSS[0])) if in_air else None
        self._unloaded = tuple(response for response in (self.air, self.loose) if response is not None)
        speed_m_s = task.travel_speed_mm_s * 1e-3
        self._dither, self._push_dither = Dither(0.0, speed_m_s), Dither(0.0, speed_m_s)

    def begin(self, setup: TrialSetup) -> None:
        """Reset the state for a new trial."""
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
        self._stationary_ticks = self._sunk_ticks = 0
        self.free()
        self.presses(self.press_N)

    def _adapt(self, tip_lever_m: float) -> None:
        """Choose amplitudes based on the noise during taring and the distance from sensor to tip."""
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
            # One window while waiting, one after it is raised and one more, each with a tenth of a second to begin.
            self.timeout_ticks = max(TIMEOUT_TICKS, 3 * (self.air.window + CONTROL_RATE_HZ // 10))
        least_N = max(0.5 * _PUSH_N, self.across.spring.least_dither_N(max(self._state.noise[:2]), self._step_m))
        self._least_push_m = min(least_N, PUSH_SHARE * self.budget_N) / self.lateral_N_per_m
        self._dithers_N = 2.0 * (self._air_m * self.axial_N_per_m + PUSH_SHARE * self.budget_N)

    def presses(self, press_N: float, play_m: float = 0.0) -> None:
        """Set the pressing force and play. The budget is the rest of the force limit; past deflection still counts."""
        self.budget_N, self.play_m = self._max_force_N - press_N, play_m
        self._from_m: Vector3 | None = None
        self._carried_N = self.spent_N

    def free(self) -> None:
        """Reset the budget after the force has responded, or where the tool cannot touch anything."""
        self._from_m, self._carried_N = None, 0.0
        # Lowest and highest coordinates.
        self._path_m: tuple[Vector3, Vector3] | None = None
        # There is no play towards a wall that has just responded.
        self._wall = (self.direction if self.walled else None) or (0.0, 0.0)
        self.spent_N, self.spent, self.waited_ticks, self._aimed = 0.0, False, 0, False
        self._spent_at_N = 0.0
        for response in self._unloaded:
            response.stationary_ticks = 0

    def _bends_N(self, reference_m: Vector3) -> tuple[float, float]:
        """Return the bend, as a force, of a tip that moved only by the play, and the force on one stuck on its path."""
        if self._from_m is None:
            self._from_m = reference_m
        (x, y, z), (wall_x, wall_y) = map(sub, reference_m, self._from_m), self._wall
        across_N = max(hypot(x, y) - self.play_m, x * wall_x + y * wall_y, 0.0) * self.lateral_N_per_m
        # The tip may have stuck anywhere on the path.
        lowest_m, highest_m = self._path_m or (reference_m, reference_m)
        (right_m, far_m, deep_m), (left_m, near_m, _) = (
            map(sub, reference_m, lowest_m),
            map(sub, highest_m, reference_m),
        )
        width_m = hypot(max(left_m, right_m), max(near_m, far_m))
        pressed_N = self._max_force_N - self.budget_N + deep_m * self.axial_N_per_m
        stuck_N = hypot(width_m * self.lateral_N_per_m, pressed_N)
        return self._carried_N + hypot(across_N, z * self.axial_N_per_m), stuck_N

    def bounded(self, velocity_m_s: Vector3) -> Vector3:
        """Return the velocity, or zero if it would bend the gripper by more than the budget and the dithers.

        In that case the tool waits, which limits how long it can move without a response.
        """
        if not self._tared:
            return velocity_m_s
        (x, y, z), (vx, vy, vz) = self._reference_m, velocity_m_s
        x, y, z = x + vx * PERIOD_S, y + vy * PERIOD_S, z + vz * PERIOD_S
        bend_N, stuck_N = self._bends_N((x, y, z))
        near = stuck_N <= _STUCK_SHARE * self._max_force_N
        if near and bend_N <= max(self.budget_N, self._spent_at_N) + self._dithers_N:
            return velocity_m_s
        self.wait("before the tool may go further")
        return ZERO_VELOCITY

    def check(self, snapshot: Snapshot, measured: Measurement, reference_m: Vector3, *, tared: bool) -> Trip | None:
        """Process a tick in any phase, and return a trip for a wrench that no contact at the tip can cause.

        Args:
            reference_m: Commanded tip position, (3,), task frame.
        """
        wrench, joints_ns, (x, y, z) = snapshot.wrench, snapshot.joints.source_time_ns, measured.position_m
        new, self._sequence = wrench.sequence != self._sequence, wrench.sequence
        if not tared:
            return None
        if not self._tared:
            self._tared = True
            self._adapt(measured.tip_lever_m)
            self.push(None)
        self._reference_m, (self.spent_N, _) = reference_m, self._bends_N(reference_m)
        (x0, y0, z0), (x1, y1, z1) = self._path_m or (reference_m, reference_m)
        rx, ry, rz = reference_m
        self._path_m = (min(x0, rx), min(y0, ry), min(z0, rz)), (max(x1, rx), max(y1, ry), max(z1, rz))
        if self.spent_N > self.budget_N and not self.spent:
            # A waiting tool still dithers along and across the axis.
            self.spent, self._spent_at_N = True, self.spent_N
        self.axial.add_place(joints_ns, z)
        self._stationary_ticks += 1
        self._sunk_ticks += 1
        if hypot(x - self._rests_m[0], y - self._rests_m[1]) > self._contact_m:
            # On the chamfer or the edge of a hole the tip also moves along the axis, without a force.
            self._rests_m, self._stationary_ticks = (x, y), 0
        if z > self._deepest_m + self._contact_m:
            # The same applies while the tip descends against friction.
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
        # Filtered, because the inertial force of a heavy tool is as large as a contact force. Without contact nothing
        # limits the dither, and the response of inertia is smaller than that of a spring.
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
            against_N = -fx * ux - fy * uy
            self.across.add_force(wrench.source_time_ns, -against_N)
            met = against_N > 0.5 * self.push_N + self._friction * abs(fz)
            new_wall = ux * self._wall[0] + uy * self._wall[1] < _SIMILAR
            if met and self.play_m > 0.0 and new_wall and self._from_m is not None:
                # There is no play beyond the first contact either.
                self._wall, self._from_m = self.direction, (*reference_m[:2], self._from_m[2])
                self._path_m = None
        if self.verified:
            self.free()
        return self._implausible(snapshot.tick, measured)

    def _implausible(self, tick: int, measured: Measurement) -> Trip | None:
        """Return a trip if several consecutive samples show a wrench that no contact at the tip can cause."""
        x, y, z = measured.force_N
        torque_Nm = measured.torque_across_at_tip_Nm
        # The forces of two walls that pinch a tilted peg cancel out; the torque remains.
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
        """Return the dither's velocity along the axis for a pressing tool."""
        return self._dither.velocity_m_s()

    @property
    def push_N(self) -> float:
        """Return the push force, twice that of its dither."""
        dither_N = self._push_dither.amplitude_m * self.lateral_N_per_m
        return 2.0 * min(dither_N, PUSH_SHARE * self.budget_N)

    def push_dither_m_s(self, *, met: bool = False) -> float:
        """Return the dither's velocity along a push.

        Args:
            met: True if there is contact with a wall. The push then grows until the wall responds, as shown by the
                motion of the flange, because the arm's servos yield to a stiff gripper.
        """
        budget_m, dither = self.budget_N / self.lateral_N_per_m, self._push_dither
        # Even if the flange then suddenly follows fully, it bends the gripper by no more than the budget.
        if met and self.across.swing_m < PUSH_SHARE * budget_m and dither.amplitude_m < budget_m:
            dither.amplitude_m *= _GROWTH
        return self._push_dither.velocity_m_s()

    def push(self, direction: tuple[float, float] | None) -> None:
        """Start a push in a unit direction, (2,), or end it with None; a push in a similar direction continues."""
        (ux, uy), (vx, vy) = direction or (0.0, 0.0), self.direction or (0.0, 0.0)
        if ux * vx + uy * vy > _SIMILAR:
            return
        self.direction = direction
        self._push_dither.amplitude_m = self._least_push_m
        dither_N = self._push_dither.usual_m(self._least_push_m) * self.lateral_N_per_m
        self.across.begin(max(self._state.noise[:2]), self._step_m, dither_N, self.axial.lag)

    def aim(self, force_N: tuple[float, float]) -> None:
        """Push a waiting tool against a lateral force, unless the window for an earlier push is still incomplete.

        A push along a wall causes no response.
        """
        if not self._aimed or self.across.share is not None:
            size_N = hypot(*force_N)
            self.push((-force_N[0] / size_N, -force_N[1] / size_N))
            self._aimed = True

    @property
    def verified(self) -> bool:
        """Return True if the force responds along the axis or along a push."""
        if self.axial.verified:
            return True
        live = self.walled or any(response.verified for response in self._unloaded)
        return live and not (self.axial.contradicted and self._sunk_ticks > self.axial.window)

    @property
    def walled(self) -> bool:
        """Return True if a wall responds to a push."""
        return self.direction is not None and self.across.verified

    def moves_on(self) -> None:
        """Restart the responses that require a stationary tool, because the tool is now following the force."""
        self.across.restart()
        if self.loose is not None:
            self.loose.restart()

    def wait(self, where: str, *, supported: bool = False) -> None:
        """Count a stationary tick; report a mismatch after the time-out or if the response contradicts the stiffness.

        Args:
            supported: True if the tool is pressing on something rigid.
        """
        if self._state.tick > self._waited_tick:
            self._waited_tick = self._state.tick
            self.waited_ticks += 1
        still_ticks = min(self.waited_ticks, self._stationary_ticks)
        self.axial.widen(still_ticks)
        self.across.widen(still_ticks)
        for response in self._unloaded:
            response.stationary_ticks = still_ticks
        if self.verified:
            self.free()
        contradicted = supported and self.axial.contradicted and still_ticks > self.axial.window + 2
        if contradicted or self.waited_ticks > self.timeout_ticks:
            self.mismatch(f"the force does not respond {where}")

    def mismatch(self, text: str) -> None:
        """Report a contact mismatch; the supervisor trips."""
        measured = f"stiffness along the axis {self.axial.text()}"
        if self.direction is not None:
            measured += f"; across it {self.across.text()}"
        reason = TripReason.CONTACT_MISMATCH if self.touched else TripReason.PLATE_NOT_FOUND
        self._state.mismatch(Trip(reason, self._state.tick, f"{text}: {measured}"))
