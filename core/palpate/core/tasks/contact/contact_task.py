"""Base class for contact tasks, with the path to the start, taring, the force limit, and early termination."""

from abc import abstractmethod
from enum import Enum
from math import dist

from typing_extensions import override

from palpate.core.motion import Controller, TipMotion
from palpate.core.policy import Observation
from palpate.core.ports import ZERO_VELOCITY, CommandReason, JointCommand, Snapshot, Validity, Vector3
from palpate.core.tasks.contact.monitor import Monitor
from palpate.core.tasks.contact.path_to_start import Lift, RunningPhase, Settle, Transfer
from palpate.core.tasks.contact.trial_state import TrialState
from palpate.core.trial import (
    INTERRUPT,
    CommandOverride,
    ExplorationArea,
    Measurement,
    Outcome,
    Phase,
    PhaseConstraints,
    Task,
    TaskConfig,
    TrialReport,
    TrialSetup,
    Trip,
    require_place,
)


class ContactTask(Task):
    """Task that lifts, moves to the start and tares; a subclass adds its own phases in :meth:`_follow`.

    Args:
        measurement: Measurement that transforms snapshots to the task frame.

    Attributes:
        constraints: Constraints on contact and position in the current phase, for the supervisor.
        tip_m: Tip position from the encoders at the last tick, (3,), task frame.
        turned_rad: Tool tilt and yaw from the encoders, (2,), in tasks that turn the tool.
    """

    def __init__(
        self,
        task: TaskConfig,
        measurement: Measurement,
        motion: TipMotion,
        free: Controller,
        state: TrialState,
        monitor: Monitor,
    ) -> None:
        self._measurement, self._motion = measurement, motion
        self._max_force_N = task.max_force_N
        self._lift, self._transfer = Lift(task, motion, free), Transfer(task, motion, free, state)
        self._settle = Settle(task, measurement, state)
        self._state, self._monitor = state, monitor
        self._running: RunningPhase
        self._interrupted = False

    @abstractmethod
    def _follow(self) -> None:
        """Enter the next phase or end the trial, after the settling phase or one of the task's own."""

    def _may_end(self) -> bool:
        """Return True if an interrupted trial may end at the current tick."""
        return True

    @override
    def begin(self, setup: TrialSetup) -> None:
        self._measurement.reset()
        self._state.begin(setup)
        self._settle.begin()
        self._monitor.begin(setup)
        self._running = self._lift
        self.constraints = self._state.constraints
        self.tip_m = self._measurement.position_m
        self._interrupt_noted = False
        self._clamped_tick = -2

    @override
    def sense(self, snapshot: Snapshot) -> Observation | None:
        state, (tick, _, wrench, joints, applied) = self._state, snapshot
        state.observation, self._velocity_m_s = None, ZERO_VELOCITY
        state.tick = tick
        state.report.ticks = tick + 1
        if tick == 0:
            require_place(joints, self._measurement.joints)
            self._motion.start(joints.position_rad)
        if applied is not None and applied.reason is not CommandReason.AS_REQUESTED:
            state.report.clamped_ticks += 1
            sound = self._motion.adopt(applied)
            if applied.reason is CommandReason.STOPPED:
                state.end(Outcome.STOPPED, "the arm was stopped from outside")
                return None
            if not sound:
                state.end(Outcome.SENSOR_FAULT, "the arm reports joint angles outside its range as applied")
                return None
        # A saturated sample may hide a larger force, so saturation also ends the trial.
        if wrench.validity is not Validity.VALID or joints.validity is not Validity.VALID:
            state.end(
                Outcome.SENSOR_FAULT, f"force sample {wrench.validity.value}, joint sample {joints.validity.value}"
            )
            return None
        state.snapshot = snapshot
        self._measurement.update(snapshot)
        self.tip_m, self.turned_rad = self._measurement.position_m, self._measurement.turned_rad
        if state.constraints.mismatch is not None:
            # A supervisor would have tripped at the tick of the mismatch.
            state.end(Outcome.CONTACT_MISMATCH, state.constraints.mismatch.text)
        elif self._interrupted:
            self._wind_up()
        if state.phase is not Phase.DONE:
            self._hold_force_limit()
        if state.phase is not Phase.DONE:
            tared, reference_m = self._settle.bias is not None, self._motion.reference_m
            trip = self._monitor.check(snapshot, self._measurement, reference_m, tared=tared)
            if trip is not None:
                state.mismatch(trip)
            else:
                self._velocity_m_s = self._running.step()
                if self._running.over:
                    self._go_on()
            self.constraints = state.constraints
        return state.observation

    def act(self) -> JointCommand:
        """Return the command in the second half of a tick, after any choice that was due."""
        if self._state.observation is not None:
            self.choose()
        velocity_m_s = self._monitor.bounded(self._velocity_m_s)
        # The choice or the motion may have caused a mismatch.
        self.constraints = self._state.constraints
        return self._motion.move(velocity_m_s)

    def _go_on(self) -> None:
        """Enter the phase that follows the completed one."""
        phase = self._state.phase
        if phase is Phase.LIFT:
            self._enter(Phase.TRANSFER, self._transfer, contact=False)
            # The tool was already up: this tick is the first of the next phase.
            self._velocity_m_s = self._transfer.step()
            if self._transfer.over:
                self._go_on()
        elif phase is Phase.TRANSFER:
            self._settle.enter()
            self._enter(Phase.SETTLE, self._settle, contact=False)
        else:
            self._follow()

    def _enter(
        self, phase: Enum, running: RunningPhase, *, contact: bool = True, area: ExplorationArea | None = None
    ) -> None:
        self._running = running
        self._state.enter(phase, PhaseConstraints(contact, self._settle.bias, area))

    @override
    def interrupt(self) -> None:
        self._interrupted = True

    @override
    def tripped(self, trip: Trip) -> None:
        self._state.event("trip", f"{trip.reason.name}: {trip.text}")
        if not self.done:
            self._state.end(Outcome.TRIPPED, trip.text)
        elif self._state.report.outcome in (Outcome.INSERTED, Outcome.DONE):
            # The success was reported at this tick, based on samples that may be wrong.
            self._state.report.outcome = Outcome.TRIPPED

    @override
    def conclude(self) -> None:
        return

    def clamped(self, command_override: CommandOverride) -> None:
        """Record that the supervisor changed a command; consecutive ticks are recorded once."""
        if self._state.tick != self._clamped_tick + 1:
            requested, given = (
                " ".join(f"{q:.6f}" for q in angles)
                for angles in (command_override.requested_rad, command_override.command_rad)
            )
            self._state.event("clamp", f"{command_override.reason.name}: requested {requested}, applied {given} rad")
        self._clamped_tick = self._state.tick

    @property
    def report(self) -> TrialReport:
        """Return the report on the current or latest trial."""
        return self._state.report

    @property
    def phase(self) -> Enum:
        """Return the current phase."""
        return self._state.phase

    @property
    def snapshot(self) -> Snapshot:
        """Return the latest snapshot with valid samples."""
        return self._state.snapshot

    @property
    def wrench_at_tip(self) -> tuple[Vector3, Vector3]:
        """Return the tared, filtered force (3,) N and torque about the tip (3,) N m at the last tick, task frame."""
        return self._measurement.filtered_wrench_at_tip()

    @property
    def filter_state(self) -> list[float]:
        """Return the tare and wrench filter state; after :meth:`begin`, it is the trial's initial state."""
        return self._measurement.filter_state

    @property
    def done(self) -> bool:
        """Return True if the trial has ended."""
        return self._state.phase is Phase.DONE

    def _wind_up(self) -> None:
        if not self._interrupt_noted:
            # A replay must interrupt the trial at exactly this tick.
            self._interrupt_noted = True
            self._state.event(INTERRUPT, "requested")
        if self._may_end():
            self._state.end(Outcome.INTERRUPTED, "on request")

    def _hold_force_limit(self) -> None:
        if self._settle.bias is None:
            # Weight and offset are still unknown: use the change since the beginning of the trial.
            if self._state.tick == 0:
                self._first_force_N = self._measurement.force_N
            force = dist(self._measurement.force_N, self._first_force_N)
            if force > self._max_force_N:
                self._state.end(Outcome.FORCE_LIMIT, f"{force:.2f} N above the start of the trial, before taring")
            return
        force = self._measurement.force_norm_N
        if force > self._state.report.peak_force_N:
            self._state.report.peak_force_N = force
            if force > self._max_force_N:
                self._state.end(Outcome.FORCE_LIMIT, f"{force:.2f} N, limit {self._max_force_N:g} N")
