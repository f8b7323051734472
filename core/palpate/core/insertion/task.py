"""The insertion task: approach to contact, exploration of the surface, insertion to full depth.

A state machine without I/O: one :class:`~palpate.core.ports.values.Snapshot` in, one joint command out, a tick of
140 Hz at a time. A tick has two halves with the choice of an action between them, for a chooser outside. It uses
port data only. Encoders cannot see the gripper's springs, so the hole is found by the loss of the reaction force and
confirmed by motion along the tool axis until contact again; depth is the encoders' depth corrected by force over
stiffness.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import dist, sqrt
from typing import Final

from palpate.core.errors import DeviceError
from palpate.core.insertion.agent import Agent
from palpate.core.insertion.axial_check import HIGHEST_SHARE, LOWEST_SHARE
from palpate.core.insertion.config import N_PER_KGF, ControlConfig, TaskConfig
from palpate.core.insertion.expectation import Expectation, Intervention, Trip
from palpate.core.insertion.frame import ExplorationArea
from palpate.core.insertion.measurement import Measurement
from palpate.core.insertion.proof import ContactProof
from palpate.core.insertion.trial import Event, Outcome, Phase, Purpose, TrialReport, TrialSetup, generator
from palpate.core.motion import ControlLaw, DampingControl, ForceControl, HybridControl, PositionControl, TipMotion
from palpate.core.policy import Observation
from palpate.core.ports import CONTROL_RATE_HZ, CommandReason, JointCommand, Snapshot, Validity, Vector3

PERIOD_S: Final = 1.0 / CONTROL_RATE_HZ
INTERRUPT: Final = "interrupt"
"""Name of the event at the tick in which an interruption was first seen."""
_LOST_TICKS: Final = 4
"""So many unfiltered samples without contact mean that it is lost; the filtered force lags by 60 ms."""
_STALL_TICKS: Final = CONTROL_RATE_HZ // 2
"""Insertion that gains no depth for so long has met something."""
_STALL_M: Final = 1e-4
_JAM_TICKS: Final = 3 * CONTROL_RATE_HZ
_DROP_M: Final = 3e-4
"""A tip this far below the surface is in the hole; a drop that ends before was an edge, and exploration goes on."""
_RISE_M: Final = 5e-4
_RISEN_TICKS: Final = 8
"""A tip that presses so far above the surface, for so long, presses on nothing."""
_SURFACE_M: Final = 1e-4
"""A height that differs by more than this from the surface's is not the surface's."""
_MOVING_SHARE: Final = 0.8
"""Share of an action's time in which the tip moves; in the rest the torque settles before it is read."""
_ACROSS_SPEED_M_S: Final = 0.005
_NO_CONTACT_M: Final = 0.008
"""How far below the nominal surface (beyond the insertion depth) the approach may search for contact."""
_PAST_PLATE_M: Final = 1e-3
"""A tip so far below where the plate must be is in the hole, or its sensor is dead."""
_PAST_FLOOR_M: Final = 3e-4
_WALL_M: Final = 5e-4
"""Depth at which a wall is looked for; half the insertion depth where that is less."""
_UNPROVED_M: Final = 1.5e-3
"""The tip goes so much deeper, and no further, before a wall has answered."""
_SEATED_SHARE: Final = 0.7
"""Share of the pressing force, filtered, from which the floor is pressed enough for the lift."""
_PRESSED_SHARE: Final = 0.6
"""The same while exploring."""
_RESTING_SHARE: Final = 0.45
"""The same for a rest on the way down: a lift takes off 0.4 of the pressing force."""
_RESTING_TICKS: Final = CONTROL_RATE_HZ // 10
_SEATING_TICKS: Final = CONTROL_RATE_HZ // 2
"""Time for that; friction on the walls may keep it from being reached."""


class InsertionTask:
    """One arm's insertion, trial by trial.

    Args:
        task: What is to be done.
        control: Gains.
        measurement: From snapshots to the task frame.
        motion: From tip velocities to joint commands.
        agent: Perception, policy and learning.

    Attributes:
        report: The account of the trial that runs, or of the last one.
        phase: Where in the trial it is.
        expectation: What the task expects of the world in this phase, for the supervisor.
        tip_m: Tip according to the encoders, (3,), task frame, as of the last tick.
    """

    def __init__(
        self,
        task: TaskConfig,
        control: ControlConfig,
        measurement: Measurement,
        motion: TipMotion,
        agent: Agent,
    ) -> None:
        self._task, self._measurement, self._motion, self._agent = task, measurement, motion, agent
        self._contact_N = task.contact_kgf * N_PER_KGF
        self._press_N = task.press_kgf * N_PER_KGF
        self._axial_N_per_m = control.axial_stiffness_N_per_mm * 1e3
        self._ready_z_m = -task.ready_height_mm * 1e-3
        self._depth_m = task.insertion_depth_mm * 1e-3
        self._tolerance_m = task.depth_tolerance_mm * 1e-3
        self._surface_slack_m = task.surface_uncertainty_mm * 1e-3
        self._free_motion: ControlLaw
        self._press: ControlLaw
        self._inserting: ControlLaw
        self._make_laws(task, control)
        self._handlers: dict[Phase, Callable[[], Vector3]] = {
            Phase.LIFT: self._lift,
            Phase.TRANSFER: self._transfer,
            Phase.SETTLE: self._settle,
            Phase.APPROACH: self._approach,
            Phase.EXPLORE: self._explore,
            Phase.INSERT: self._insert,
            Phase.PROVE: self._prove,
        }
        self._proof: ContactProof | None = None
        if task.prove_contact:
            self._proof = ContactProof(task, control, measurement.lever_m)
        self.report = TrialReport(TrialSetup(0, 0, (0.0, 0.0)))
        self.phase = Phase.DONE
        self._interrupted = False

    def _make_laws(self, task: TaskConfig, control: ControlConfig) -> None:
        travel = task.travel_speed_mm_s * 1e-3
        lateral_N_per_m = control.lateral_stiffness_N_per_mm * 1e3
        press = (0.0, 0.0, -task.press_kgf * N_PER_KGF)
        along = DampingControl(control.damping_N_s_per_m, press, travel, self._axial_N_per_m, PERIOD_S)
        self._free_motion = PositionControl(control.position_gain_per_s, travel, PERIOD_S)
        self._press = HybridControl(self._free_motion, along)
        self._inserting = HybridControl(
            ForceControl(
                control.force_integral_m_per_N_s,
                control.force_proportional_m_per_N,
                (0.0, 0.0, 0.0),
                _ACROSS_SPEED_M_S,
                lateral_N_per_m,
                PERIOD_S,
            ),
            along,
        )

    def begin(self, setup: TrialSetup) -> None:
        """Prepare for a trial; the next ``step`` is its first tick."""
        self._agent.begin(setup.index, generator(setup.seed, Purpose.POLICY, setup.index))
        self._measurement.reset()
        # The lists are the living ones: an observer sees a decision as it is made.
        self.report = TrialReport(setup, temperature=self._agent.temperature, decisions=self._agent.decisions)
        self.phase = Phase.LIFT
        self._area = ExplorationArea.of(self._task, setup.start_m)
        self._target_m: Vector3 = (0.0, 0.0, 0.0)
        self._observation: Observation | None = None
        self._velocity_m_s: Vector3 = (0.0, 0.0, 0.0)
        self._tick = 0
        self._countdown = 0
        self._tared = False
        self._first_force_N: Vector3 = (0.0, 0.0, 0.0)
        self._bias_sum = [0.0] * 6
        self._bias: tuple[float, float, float, float, float, float] | None = None
        # A trial may begin with the peg still in the hole of the one before.
        self.expectation = Expectation(contact=True)
        self.tip_m: Vector3 = (0.0, 0.0, 0.0)
        self._explore_start = 0
        self._lost_ticks = 0
        self._step_from_m: Vector3 = (0.0, 0.0, 0.0)
        self._step_m = (0.0, 0.0)
        self._hole_tick: int | None = None
        self._surface_m = 0.0
        self._best_depth_m = 0.0
        self._last_progress = 0
        self._interrupt_noted = False
        self._clamped_tick = -2
        self._checking, self._rest_ticks, self._risen_ticks = False, 0, 0
        self._touched = self._floor = False
        self._slack_m = 0.0
        if self._proof is not None:
            self._proof.begin()

    def step(self, snapshot: Snapshot) -> JointCommand:
        """One control tick: what was sensed in, what the arm shall do out.

        Raises:
            DeviceError: It is not known where the arm is when the trial begins, so there is nothing to command.
        """
        self.sense(snapshot)
        return self.act()

    def sense(self, snapshot: Snapshot) -> Observation | None:
        """The first half of a tick: what was sensed in; :meth:`act` is the second.

        Returns:
            What the policy will choose an action by in the second half; None in the many ticks without a choice.

        Raises:
            DeviceError: It is not known where the arm is when the trial begins, so there is nothing to command; or the
                encoders give another number of joint angles than the arm has.
        """
        self._observation, self._velocity_m_s = None, (0.0, 0.0, 0.0)
        self._tick = snapshot.tick
        self.report.ticks = snapshot.tick + 1
        if snapshot.tick == 0:
            if snapshot.joints.validity is not Validity.VALID:
                raise DeviceError("joint encoder", f"the first sample of the trial is {snapshot.joints.validity.value}")
            self._measurement.require_joints(snapshot.joints.position_rad)
            self._motion.start(snapshot.joints.position_rad)
        if snapshot.applied is not None and snapshot.applied.reason is not CommandReason.AS_ASKED:
            self.report.clamped_ticks += 1
            self._motion.adopt(snapshot.applied)
            if snapshot.applied.reason is CommandReason.STOPPED:
                self._end(Outcome.STOPPED, "the arm was stopped from outside")
                return None
        # A limit that a sample shows may be exceeded further by the truth: saturation ends the trial too.
        if snapshot.wrench.validity is not Validity.VALID or snapshot.joints.validity is not Validity.VALID:
            self._end(
                Outcome.SENSOR_FAULT,
                f"force sample {snapshot.wrench.validity.value}, joint sample {snapshot.joints.validity.value}",
            )
            return None
        self._snapshot = snapshot
        self._measurement.update(snapshot)
        self.tip_m = self._measurement.position_m
        if self.expectation.doubt is not None:
            # A supervisor would have taken over in the tick of the doubt.
            self._end(Outcome.UNPROVED, self.expectation.doubt.text)
        elif self._interrupted:
            self._wind_up()
        if not self.done and self._within_force_limit() and not self._contradicted():
            self._velocity_m_s = self._handlers[self.phase]()
        return self._observation

    def act(self) -> JointCommand:
        """The second half of a tick: command the arm, after a choice where one is due and not made yet."""
        if self._observation is not None:
            self.choose()
        return self._motion.move(self._velocity_m_s)

    def choose(self) -> None:
        """Let the policy choose by what :meth:`sense` returned, ahead of :meth:`act`: for loops that time it apart.

        Raises:
            LifecycleError: There is no choice in this tick.
        """
        self._observation = None
        self._next_action()
        self._velocity_m_s = self._way_on()

    def interrupt(self) -> None:
        """End the trial as soon as the running action is over, and any later one at once.

        Safe to call from a signal handler.
        """
        self._interrupted = True

    def tripped(self, trip: Trip) -> None:
        """The supervisor has taken over: the trial is over."""
        self._event("trip", f"{trip.reason.name}: {trip.text}")
        if not self.done:
            self._end(Outcome.TRIPPED, trip.text)
        elif self.report.outcome is Outcome.INSERTED:
            # Said in this very tick, from samples that are not to be trusted.
            self.report.outcome = Outcome.TRIPPED

    def clamped(self, intervention: Intervention) -> None:
        """The supervisor has changed a command; noted at the first tick of each stretch."""
        if self._tick != self._clamped_tick + 1:
            asked, given = (
                " ".join(f"{q:.6f}" for q in angles) for angles in (intervention.asked_rad, intervention.command_rad)
            )
            self._event("clamp", f"{intervention.reason.name}: asked {asked}, applied {given} rad")
        self._clamped_tick = self._tick

    @property
    def wrench_at_tip(self) -> tuple[Vector3, Vector3]:
        """Tared, filtered force (3,) N and torque about the tip (3,) N m, task frame, as of the last tick."""
        return self._measurement.filtered_wrench_at_tip()

    @property
    def percept(self) -> tuple[int, int] | None:
        """Symbol and state last perceived in this trial, as indices; None before the first."""
        return self._agent.percept

    @property
    def filter_state(self) -> list[float]:
        """Tare and memory of the wrench filter; after :meth:`begin` what a trial starts with."""
        return self._measurement.filter_state

    @property
    def done(self) -> bool:
        """Whether the trial has ended."""
        return self.phase is Phase.DONE

    def _wind_up(self) -> None:
        if not self._interrupt_noted:
            # A replay must interrupt the trial at this very tick.
            self._interrupt_noted = True
            self._event(INTERRUPT, "requested")
        if self.phase is not Phase.EXPLORE or self._countdown <= 1:
            self._end(Outcome.INTERRUPTED, "on request")

    def _within_force_limit(self) -> bool:
        x, y, z = self._measurement.force_N
        if not self._tared:
            # Weight and offset are not known yet: what counts is the change since the trial began.
            if self._tick == 0:
                self._first_force_N = (x, y, z)
            force = dist((x, y, z), self._first_force_N)
            if force > self._task.max_force_N:
                self._end(Outcome.FORCE_LIMIT, f"{force:.2f} N more than at the start, before taring")
                return False
            return True
        force = sqrt(x * x + y * y + z * z)
        if force > self.report.peak_force_N:
            self.report.peak_force_N = force
            if force > self._task.max_force_N:
                self._end(Outcome.FORCE_LIMIT, f"{force:.2f} N, limit {self._task.max_force_N:g} N")
                return False
        return True

    def _contradicted(self) -> bool:
        proof = self._proof
        if proof is None:
            return False
        proof.update(self._snapshot)
        if not self._tared or self.phase is Phase.SETTLE:
            return False
        trip = proof.contradiction(self._tick, self._measurement)
        if trip is not None:
            self._doubt(trip)
        return trip is not None

    # Phases. Each returns the tip velocity for this tick.

    def _lift(self) -> Vector3:
        x, y, z = self._motion.reference_m
        if z <= self._ready_z_m + 1e-6:
            self._enter(Phase.TRANSFER)
            return self._transfer()
        return self._free_motion.velocity_m_s((x, y, z), (x, y, self._ready_z_m), (0.0, 0.0, 0.0))

    def _transfer(self) -> Vector3:
        reference = self._motion.reference_m
        target = (*self.report.setup.start_m, self._ready_z_m)
        if max(abs(r - t) for r, t in zip(reference, target, strict=True)) < 1e-6:
            self._enter(Phase.SETTLE)
            self._countdown = 2 * self._task.tare_ticks
        return self._free_motion.velocity_m_s(reference, target, (0.0, 0.0, 0.0))

    def _settle(self) -> Vector3:
        self._countdown -= 1
        if self._countdown < self._task.tare_ticks:
            wrench = self._snapshot.wrench
            if self._proof is not None:
                self._proof.life.rest(wrench)
            for i, value in enumerate((*wrench.force_N, *wrench.torque_Nm)):
                self._bias_sum[i] += value
        if self._countdown == 0:
            a, b, c, d, e, f = (total / self._task.tare_ticks for total in self._bias_sum)
            self._bias = (a, b, c, d, e, f)
            self._measurement.tare(self._bias)
            self._tared = True
            self._event("tare", f"{a:.6g} {b:.6g} {c:.6g} N, {d:.6g} {e:.6g} {f:.6g} N m, sensor frame")
            self._enter(Phase.APPROACH)
            self._target_m = self._motion.reference_m
        return 0.0, 0.0, 0.0

    def _approach(self) -> Vector3:
        depth = self._tip_depth_m()
        if self._proof is not None:
            self._watch_touch(self._proof)
        if self._in_contact():
            self._explore_start = self._tick
            if depth >= self._depth_m - self._tolerance_m - self._surface_slack_m:
                # The surface was never touched, so its height is known only as well as the plate was set up.
                self._event("hole", "the approach went straight into it")
                self._end_inserted(depth)
                return 0.0, 0.0, 0.0
            self._surface_m = depth
            self._event("contact", f"surface at {depth * 1e3:.3f} mm below the nominal plane")
            self._step_from_m, self._step_m = self._motion.reference_m, (0.0, 0.0)
            self._enter(Phase.EXPLORE)
            self._countdown = self._task.ticks_per_action
        elif self._proof is not None and depth > self._surface_slack_m + _PAST_PLATE_M:
            self._explore_start = self._tick
            # The surface was never touched, so its height is known only as well as the plate was set up.
            self._slack_m = self._surface_slack_m
            self._enter_hole("nothing felt where the plate must be")
        elif self._motion.reference_m[2] > self._depth_m + _NO_CONTACT_M:
            # By the reference, so that the search also ends for an arm that does not follow.
            self._end(Outcome.NO_CONTACT, f"nothing touched, tip at {depth * 1e3:.2f} mm")
        return self._press.velocity_m_s(self._motion.reference_m, self._target_m, self._measurement.force_N)

    def _explore(self) -> Vector3:
        measured = self._measurement
        if self._tick - self._explore_start >= self._task.time_limit_s * CONTROL_RATE_HZ:
            self._end(Outcome.TIME_LIMIT, f"{self._task.time_limit_s:g} s")
            return 0.0, 0.0, 0.0
        self._agent.record_effort(measured.position_m, measured.force_N)
        lost = measured.force_N[2] > -self._contact_N
        # Friction on the hole's wall can go on pushing back while the peg already sinks: depth shows it as well.
        # Before the first action the surface is not known well: encoders on a slow bus lag behind the force.
        sunk = bool(self._agent.decisions) and self._tip_depth_m() - self._surface_m > _DROP_M
        if lost or sunk:
            # Moving on across a hole while the peg drops would press it against the wall: the step ends here.
            self._step_from_m, self._step_m = self._motion.reference_m, (0.0, 0.0)
            self._lost_ticks += 1
            if self._lost_ticks == _LOST_TICKS:
                self._enter_hole("contact lost" if lost else "sunk below the surface")
        else:
            self._lost_ticks = 0
            if self._proof is not None:
                check = self._check_while_exploring(self._proof)
                if check is not None:
                    return check
            self._countdown -= 1
            if self._countdown <= 0:
                self._perceive()
                return 0.0, 0.0, 0.0  # where to go is known when the policy has chosen
        return self._way_on()

    def _way_on(self) -> Vector3:
        self._target_m = self._point_of_step()
        return self._press.velocity_m_s(self._motion.reference_m, self._target_m, self._measurement.force_N)

    def _point_of_step(self) -> Vector3:
        """Where on its way the running action shall be in this tick: steady speed, then rest for the torque."""
        ticks = self._task.ticks_per_action
        share = min((ticks - self._countdown + 1) / (_MOVING_SHARE * ticks), 1.0)
        (x, y, z), (dx, dy) = self._step_from_m, self._step_m
        return x + share * dx, y + share * dy, z

    def _enter_hole(self, sign: str) -> None:
        self._event(sign)
        self._hole_tick = self._tick
        self._best_depth_m, self._last_progress = 0.0, self._tick
        self._checking, self._rest_ticks = False, 0
        self._inserting.reset()
        if self._proof is not None:
            self._proof.wall.begin(self._motion.reference_m[:2])
        self._enter(Phase.INSERT)

    def _perceive(self) -> None:
        measured = self._measurement
        self._refine_surface()
        force, torque = measured.filtered_wrench_at_tip()
        self._observation = self._agent.perceive(
            self._tick, measured.position_m, self._motion.reference_m, force, torque
        )

    def _next_action(self) -> None:
        reference = self._motion.reference_m
        dx, dy = self._agent.choose().action.displacement_m
        x, y = self._area.clamp(reference[0] + dx, reference[1] + dy)
        self._step_from_m, self._step_m = reference, (x - reference[0], y - reference[1])
        self._countdown = self._task.ticks_per_action

    def _refine_surface(self) -> None:
        """Depth counts from the surface: correct its height while pressing is steady and the peg surely rests on it."""
        rise = self._tip_depth_m() - self._surface_m
        first = not self._agent.decisions
        if self._measurement.force_N[2] < -0.5 * self._press_N and (first or abs(rise) < _SURFACE_M):
            self._surface_m += rise if first else 0.3 * rise

    def _insert(self) -> Vector3:
        depth = self._tip_depth_m() - self._surface_m
        if depth > self._best_depth_m + _STALL_M:
            self._best_depth_m, self._last_progress = depth, self._tick
        stalled = self._tick - self._last_progress
        if self._proof is not None:
            check = self._check_at_rest(self._proof)
            if check is not None:
                return check
        if self._proof is not None and not self._proof.wall.answered and depth > min(_WALL_M, 0.5 * self._depth_m):
            return self._push_aside(self._proof, depth)
        if depth >= self._depth_m + self._tolerance_m or (
            depth >= self._depth_m - self._tolerance_m - self._slack_m and self._in_contact()
        ):
            self._event("hole", f"found after {self._exploration_s():.3f} s")
            if self._proof is None:
                self._end_inserted(depth)
            else:
                # Where the plate was never touched, only the floor can show that the force along the axis is alive.
                self._floor, self._countdown = self._in_contact() or self._slack_m > 0.0, _SEATING_TICKS
                self._checking = False
                self._proof.wall.begin(self._motion.reference_m[:2])
                self._enter(Phase.PROVE)
        elif stalled > _STALL_TICKS and self._best_depth_m < _DROP_M:
            self._event("false drop", f"to {self._best_depth_m * 1e3:.3f} mm")
            self._hole_tick = None
            self._step_from_m, self._step_m = self._motion.reference_m, (0.0, 0.0)
            self._lost_ticks = 0
            self._enter(Phase.EXPLORE)
        elif stalled > _JAM_TICKS:
            self._end(Outcome.JAMMED, f"at {depth * 1e3:.2f} mm")
        return self._sinking()

    def _sinking(self) -> Vector3:
        reference = self._motion.reference_m
        velocity = self._inserting.velocity_m_s(reference, self._target_m, self._measurement.force_N)
        return velocity if self._proof is None else self._proof.wall.bounded(velocity, reference)

    def _prove(self) -> Vector3:
        """The tip is as deep as it shall be: the floor has to push back as one does, or where there is none, a wall."""
        depth, proof = self._tip_depth_m() - self._surface_m, self._proof
        if proof is None:
            return self._sinking()
        if not self._floor:
            across = proof.wall.velocity_m_s(self._measurement.force_N, proof.new, self._motion.reference_m)
            if proof.wall.failed:
                self._doubt(proof.no_wall(self._tick, depth))
            elif proof.wall.answered:
                self._event("proof", f"wall: {proof.wall.answer_N:.2f} N at {depth * 1e3:.2f} mm")
                self._end_inserted(depth)
            return *across, 0.0
        if not self._checking:
            self._countdown -= 1
            deepest_m = self._depth_m + self._tolerance_m + self._slack_m + _PAST_FLOOR_M
            pressed_N, needed_N = -self._measurement.filtered_force_z_N, _SEATED_SHARE * self._press_N
            if depth > deepest_m:
                self._doubt(proof.no_floor(self._tick, depth, deepest_m))
            elif self._countdown <= 0:
                self._doubt(proof.floor_too_soft(self._tick, pressed_N, needed_N))
            elif pressed_N < needed_N:
                return self._sinking()
            self._checking = True
            proof.axial.begin()
        along = self._lift_to_check(proof)
        if along is None and proof.axial.passed:
            self._event("proof", f"floor: {proof.axial.share:.2f} of the gripper's stiffness")
            self._end_inserted(depth)
        return 0.0, 0.0, along or 0.0

    # Proof of contact.

    def _watch_touch(self, proof: ContactProof) -> None:
        proof.touch.watch(self._snapshot, self._measurement.force_N[2], self._measurement.position_m[2])

    def _check_while_exploring(self, proof: ContactProof) -> Vector3 | None:
        """Where the tip goes instead, while a check is made; None when there is nothing to check."""
        if not self._checking:
            if not self._touched:
                self._judge_touch(proof)
            proof.life.watch(self._snapshot.wrench, self._motion.reference_m)
            rise_m = self._surface_m - self._tip_depth_m()
            self._risen_ticks = self._risen_ticks + 1 if rise_m > _RISE_M else 0
            if self._touched and self._risen_ticks > _RISEN_TICKS:
                self._doubt(proof.above_plate(self._tick, rise_m, _RISE_M))
            if not proof.life.due:
                return None
            if self._measurement.filtered_force_z_N > -_PRESSED_SHARE * self._press_N:
                return self._press.velocity_m_s(
                    self._motion.reference_m, self._motion.reference_m, self._measurement.force_N
                )
            self._checking = True
            proof.axial.begin()
        along = self._lift_to_check(proof)
        if along is None and proof.axial.passed:
            self._event("proof", f"lift: {proof.axial.share:.2f} of the gripper's stiffness")
            proof.life.proved()
        return 0.0, 0.0, along or 0.0

    def _judge_touch(self, proof: ContactProof) -> None:
        """Before the first choice: the touch itself shows the gripper's stiffness, or a lift has to."""
        self._watch_touch(proof)
        if self._countdown > 1:
            return
        self._touched, share = True, proof.touch.share
        if share is not None and LOWEST_SHARE <= share <= HIGHEST_SHARE:
            self._event("proof", f"first touch: {share:.2f} of the gripper's stiffness")
        else:
            proof.life.demand_check()

    def _check_at_rest(self, proof: ContactProof) -> Vector3 | None:
        """A peg that rests on something on its way down has met a wall or the plate, or its sensor is held."""
        resting = self._measurement.filtered_force_z_N < -_RESTING_SHARE * self._press_N
        self._rest_ticks = self._rest_ticks + 1 if resting else min(self._rest_ticks, 0)
        if not self._checking:
            if self._rest_ticks < _RESTING_TICKS:
                return None
            self._checking = True
            proof.axial.begin()
        along = self._lift_to_check(proof)
        if along is None:
            self._rest_ticks = -_STALL_TICKS
        return 0.0, 0.0, along or 0.0

    def _lift_to_check(self, proof: ContactProof) -> float | None:
        """Velocity along the tool axis in a check that runs; None when it is over, with a doubt where it failed."""
        force_z_N, reference_z_m = self._measurement.force_N[2], self._motion.reference_m[2]
        along = proof.axial.velocity_m_s(force_z_N, proof.new, reference_z_m, self._measurement.position_m[2])
        if along is None:
            self._checking = False
            if proof.axial.share is not None and not proof.axial.passed:
                self._doubt(proof.no_spring(self._tick))
        return along

    def _push_aside(self, proof: ContactProof, depth_m: float) -> Vector3:
        """Sink on, but not far, while a wall is looked for."""
        reference, force = self._motion.reference_m, self._measurement.force_N
        across = proof.wall.velocity_m_s(force, proof.new, reference)
        if proof.wall.answered:
            self._event("proof", f"wall: {proof.wall.answer_N:.2f} N at {depth_m * 1e3:.2f} mm")
        elif proof.wall.failed:
            unseen = self._slack_m > 0.0
            limit_m = self._slack_m + _PAST_PLATE_M
            self._doubt(proof.no_plate(self._tick, depth_m, limit_m) if unseen else proof.no_wall(self._tick, depth_m))
        along = self._inserting.velocity_m_s(reference, self._target_m, force)[2]
        if depth_m > _WALL_M + self._slack_m + _UNPROVED_M:
            along = min(along, 0.0)
        return *across, along

    def _doubt(self, trip: Trip) -> None:
        """The supervisor trips in this very tick; without one the trial ends in the next."""
        self._event("doubt", f"{trip.reason.name}: {trip.text}")
        self.expectation = replace(self.expectation, doubt=trip)

    # Small helpers.

    def _in_contact(self) -> bool:
        return self._measurement.filtered_force_z_N < -self._contact_N

    def _tip_depth_m(self) -> float:
        """Depth of the true tip below the nominal plane: encoders, corrected for the axial spring."""
        return self._measurement.position_m[2] + self._measurement.force_N[2] / self._axial_N_per_m

    def _exploration_s(self) -> float:
        end = self._tick if self._hole_tick is None else self._hole_tick
        return (end - self._explore_start) * PERIOD_S

    def _enter(self, phase: Phase) -> None:
        self.phase = phase
        touching = phase not in (Phase.TRANSFER, Phase.SETTLE)
        if phase is Phase.EXPLORE and self._proof is not None:
            self._proof.life.resume()
        self.expectation = Expectation(touching, self._bias, self._area if phase is Phase.EXPLORE else None)
        self._event("phase", phase.value)

    def _event(self, name: str, detail: str = "") -> None:
        self.report.events.append(Event(self._tick, name, detail))

    def _end_inserted(self, depth_m: float) -> None:
        self._agent.reached_goal()
        self.report.depth_m = depth_m
        self._end(Outcome.INSERTED, f"depth {depth_m * 1e3:.3f} mm")

    def _end(self, outcome: Outcome, detail: str) -> None:
        self.report.outcome = outcome
        if outcome in (Outcome.TIME_LIMIT, Outcome.JAMMED, Outcome.FORCE_LIMIT):
            # No goal, but it did cost: an action that always ends a trial like this must not look as good as new.
            self._agent.gave_up(self._measurement.position_m, *self._measurement.filtered_wrench_at_tip())
        if self.report.depth_m == 0.0:
            self.report.depth_m = max(self._tip_depth_m() - self._surface_m, 0.0)
        if self._explore_start:
            self.report.exploration_time_s = self._exploration_s()
        self.report.actions = len(self._agent.decisions)
        self._event("end", f"{outcome.value}: {detail}")
        self.phase = Phase.DONE
