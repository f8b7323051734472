"""The exploration, which moves the peg while pressing it on the plate until the reaction force is lost."""

from math import hypot
from typing import Final

from palpate.core.job import sliding_N
from palpate.core.policy import DONE, Action
from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, ZERO_VELOCITY, Vector3
from palpate.core.tasks.contact import PAST_PLATE_M, Monitor, RunningPhase
from palpate.core.tasks.insertion.phases.equipment import Equipment
from palpate.core.trial import N_PER_KGF, ExplorationArea, Outcome

_LOST_TICKS: Final = 4
"""Number of unfiltered samples without contact after which contact counts as lost; the filtered force lags by 60 ms."""
_SUNK_TICKS: Final = 2
"""Number of ticks below the surface; a dithering tool appears lower for one tick if encoders lag behind the force."""
_WEDGED_SHARE: Final = 1.5
"""Fraction of the pressing force above which a lateral force cannot be friction: an edge of the hole must be holding
the peg. Friction there may support the peg, so that neither loss of contact nor depth reveals the hole."""
_LAG_S: Final = 3.0 * PERIOD_S
"""Additional time to stop: the lag allowed by supervision.tracking_lag_ticks."""
_MOUTH_M: Final = 1.2e-3
"""Distance from the hole, plus play and chamfer, beyond which a peg certainly rests on the plate, not in the mouth."""
_SURFACE_M: Final = 1e-4
"""Height difference beyond which a support is not the known surface."""


class Explore(RunningPhase):
    """Exploration by actions that move across the plate, each a steady step followed by a pause.

    Args:
        monitor: Contact monitor, which dithers the tool and holds it in place until the force responds.
    """

    def __init__(self, equipment: Equipment, monitor: Monitor) -> None:
        task, self._equipment, self._monitor = equipment.task, equipment, monitor
        self._task, self._state, self._agent = task, equipment.state, equipment.agent
        self._measurement, self._motion, self._controller = (
            equipment.measurement,
            equipment.motion,
            equipment.controllers.press,
        )
        press_N = task.press_kgf * N_PER_KGF
        # If the peg is wedged, the arm stops within the force limit, unless friction alone reaches that limit.
        stop_N = monitor.lateral_N_per_m * task.travel_speed_mm_s * 1e-3 * _LAG_S
        self._wedged_N = min(_WEDGED_SHARE * press_N, max(task.max_force_N - stop_N, sliding_N(task.friction, press_N)))
        self._limit_ticks = task.time_limit_s * CONTROL_RATE_HZ
        self._ticks, self._moving_ticks = task.ticks_per_action, task.motion_duty * task.ticks_per_action
        self._contact_N, self._press_N = task.contact_kgf * N_PER_KGF, press_N

    def begin(self, start_m: tuple[float, float]) -> None:
        """Reset the state for a trial that starts at (x, y), task frame."""
        self.area = ExplorationArea.of(self._task, start_m)
        self._rests_m = list[tuple[float, float]]()
        # After an approach without contact, it is resumed without being entered and begins with a choice.
        self.countdown = 0

    def enter(self) -> None:
        """Begin with a pause after contact with the plate."""
        self.countdown = self._task.ticks_per_action
        self.resume()

    def resume(self) -> None:
        """Continue the current action, in its pause, after a false hole detection."""
        self.over = False
        self._monitor.presses(self._press_N)
        self._step_from_m, self._step_m = self._motion.reference_m, (0.0, 0.0)
        self._lost_ticks = self._deep_ticks = 0

    def step(self) -> Vector3:
        """Continue the action; once it is over, ``state.observation`` is the input to the next choice."""
        measured, state = self._measurement, self._state
        if self._out_of_time():
            return ZERO_VELOCITY
        x, y, z = measured.force_N
        self._agent.effort_N.append(measured.force_norm_N)
        lost = z > -self._contact_N
        # Friction on the hole's wall can maintain the reaction while the peg sinks, so depth is also checked. Before
        # the first action the surface is not known well: encoders on a slow bus lag behind the force.
        drop_m = self._equipment.drop_m if self._agent.decisions else PAST_PLATE_M
        deep = self._depth_m > drop_m
        self._deep_ticks = self._deep_ticks + 1 if deep else 0
        sunk = self._deep_ticks >= _SUNK_TICKS
        wedged = hypot(x, y) > self._wedged_N
        if lost or sunk or wedged:
            # Moving across a hole while the peg drops would press it against the wall, so the step ends here.
            self._step_from_m, self._step_m = self._motion.reference_m, (0.0, 0.0)
            self._lost_ticks += 1
            if self._lost_ticks == _LOST_TICKS:
                state.event("contact lost" if lost else "sunk below the surface" if sunk else "wedged on an edge")
                state.edge_m, self.over = self._edge_m(), True
        else:
            self._lost_ticks = 0
            if self._monitor.spent or self._monitor.axial.contradicted:
                return self._wait()
            self.countdown -= 1
            if self.countdown <= 0:
                # The direction is known once the policy has chosen.
                self._perceive()
                return ZERO_VELOCITY
        return self._advance()

    @property
    def _depth_m(self) -> float:
        return self._measurement.tip_depth_m - self._state.surface_m

    def _out_of_time(self) -> bool:
        state = self._state
        if state.tick - state.explore_start < self._limit_ticks:
            return False
        state.end(Outcome.TIME_LIMIT, f"{self._task.time_limit_s:g} s")
        return True

    def choose(self) -> Vector3:
        """Let the policy choose the next action, and return its first velocity.

        Raises:
            LifecycleError: Nothing was perceived since the last choice.
        """
        self._begin(self._agent.choose().action)
        return self._advance()

    def _begin(self, action: Action) -> None:
        """Start the given action."""
        reference, (dx, dy) = self._motion.reference_m, action.displacement_m
        x, y = self.area.clamp(reference[0] + dx, reference[1] + dy)
        self._step_from_m, self._step_m = reference, (x - reference[0], y - reference[1])
        self.countdown = self._task.ticks_per_action
        if action == DONE:
            self._state.event("done", "by the policy, to be verified")
            self._state.claimed = self.over = True

    def _advance(self) -> Vector3:
        """Return the velocity of the current action: constant speed, then a pause to let the torque settle."""
        share = (self._ticks - self.countdown + 1) / self._moving_ticks
        if share > 1.0:
            share = 1.0
        (x, y, z), (dx, dy) = self._step_from_m, self._step_m
        target_m = x + share * dx, y + share * dy, z
        vx, vy, vz = self._controller.velocity_m_s(self._motion.reference_m, target_m, self._measurement.force_N)
        return vx, vy, vz if self._lost_ticks else vz + self._monitor.dither_m_s()

    def _wait(self) -> Vector3:
        """Press and dither in place until the force responds."""
        self._monitor.wait("to the dither on the plate", supported=True)
        reference_m = self._motion.reference_m
        _, _, vz = self._controller.velocity_m_s(reference_m, reference_m, self._measurement.force_N)
        return 0.0, 0.0, vz + self._monitor.dither_m_s()

    def _perceive(self) -> None:
        measured, state = self._measurement, self._state
        self._refine_surface()
        force, torque = measured.filtered_wrench_at_tip()
        state.observation = self._agent.perceive(
            state.tick,
            measured.position_m,
            self._motion.reference_m,
            force,
            torque,
            self._motion.turn_rad,
            self._depth_m,
            self._press_N,
            self._task.max_force_N,
        )

    def _refine_surface(self) -> None:
        """Correct the height of the surface, from which depth is measured, while the peg presses steadily on it."""
        measured, state, (x, y, _) = self._measurement, self._state, self._motion.reference_m
        rise = measured.tip_depth_m - state.surface_m
        if measured.force_N[2] > -0.5 * self._press_N or (self._rests_m and rise > _SURFACE_M):
            return
        # A higher support is the surface: the peg was in the mouth of the hole before.
        state.surface_m += 0.3 * rise if self._rests_m and rise > -_SURFACE_M else rise
        self._rests_m.append((x, y))

    def _edge_m(self) -> float:
        """Return how much a hole's edge or the filter's delay may hide of the surface's height."""
        # A peg that has rested farther from here than a hole's mouth extends has seen the surface.
        x, y, _ = self._motion.reference_m
        mouth_m = _MOUTH_M + 1e-3 * (self._task.play_mm + self._task.chamfer_mm)
        aside = any(hypot(x - at_x, y - at_y) > mouth_m for at_x, at_y in self._rests_m)
        return 0.0 if aside else max(self._state.surface_m + self._task.surface_uncertainty_mm * 1e-3, 0.0)
