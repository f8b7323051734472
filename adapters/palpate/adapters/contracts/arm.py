"""The contract for the :class:`palpate.core.ports.devices.ArmCommand` port."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from itertools import chain, repeat
from threading import Thread
from time import perf_counter_ns
from typing import Final

from typing_extensions import override

from palpate.adapters.contracts.bench import (
    ArmCommandRig,
    ClauseNotApplicable,
    ContractViolation,
    parameter,
    ramp,
    require,
    require_raises,
)
from palpate.adapters.contracts.clock import TICK_NS
from palpate.adapters.contracts.device import LONG_TICKS, DeviceContract, bring
from palpate.core.errors import CommandError
from palpate.core.ports import AppliedCommand, CommandReason, JointCommand, JointVector, Life

_HANG_NS: Final = 500_000_000
_JOIN_S: Final = 0.01
_MANY_STEPS: Final = 1500
"""Limits that are more than this number of steps away are not tested, except the nearest one."""


class ArmCommandContract(DeviceContract[ArmCommandRig]):
    """Clauses for every arm; a subclass supplies the rig. All commands go through :meth:`_send`."""

    _rest_rad: JointVector = ()
    """Expected pose of the stationary arm; empty if not yet known."""
    _poses: int = 0
    """Number of poses sent."""
    _halted: bool = True
    """True if a command was in progress at the last halt, or if the pose is unknown."""
    _stopped: bool = False

    @override
    @contextmanager
    def rig(self, life: Life) -> Iterator[ArmCommandRig]:
        self._stopped, self._halted, self._rest_rad, self._poses = False, True, (), 0
        with super().rig(life) as rig:
            yield rig

    @override
    def may_use(self) -> bool:
        return self.may_command

    @override
    def use(self, rig: ArmCommandRig) -> object:
        return self._send(rig, self._rest_rad or rig.home_rad)

    @override
    def activated(self, rig: ArmCommandRig) -> None:
        self._stopped = False

    def work(self, rig: ArmCommandRig) -> None:
        """Require that a small move reaches its target, or that a stopped arm does not move and reports STOPPED."""
        requested_rad = self._next_pose(rig)
        if requested_rad == self._rest_rad:
            requested_rad = self._next_pose(rig)
        if self._stopped:
            _require_stopped(self._send(rig, requested_rad), requested_rad)
        else:
            applied = self._go(rig, requested_rad)
            is_applied = applied.reason is CommandReason.AS_REQUESTED and applied.position_rad == requested_rad
            require("each command", is_applied, f"{applied}", f"{requested_rad} with the reason AS_REQUESTED")
            self._rest_rad = requested_rad
        rig.advance(rig.settle_ticks)
        self.rest(rig)

    def start_work(self, rig: ArmCommandRig) -> None:
        """Start a small move."""
        self._send(rig, self._next_pose(rig))
        self._halted = not self._stopped

    def disturb(self, rig: ArmCommandRig) -> None:
        """Stop the arm; an active arm stays stopped."""
        rig.device.stop()
        self._stopped = self._stopped or rig.device.life is Life.ACTIVE

    def rest(self, rig: ArmCommandRig) -> None:
        """Require that the arm is at its last target, or close to the position at which a command was halted."""
        with suppress(ClauseNotApplicable):
            parameter(rig.position_rad, "position_rad")
            rig.advance(rig.settle_ticks if self._halted else 0)
            here_rad = _where(rig)
            most_rad = 0.5 * rig.step_rad if self._halted else rig.tolerance_rad
            _require_at("stationary", here_rad, self._rest_rad or here_rad, most_rad)
            if self._halted:
                self._rest_rad, self._halted = here_rad, False

    def _next_pose(self, rig: ArmCommandRig) -> JointVector:
        """Return the home pose with one joint moved; each call uses the next joint and the opposite direction."""
        self._poses += 1
        joint = self._poses % len(rig.home_rad)
        return _shifted(rig.home_rad, rig.step_rad if self._poses % 2 else -rig.step_rad, joint)

    def _send(self, rig: ArmCommandRig, requested_rad: JointVector) -> AppliedCommand:
        """Send a command; all clauses use this method."""
        if not self.may_command:
            raise ClauseNotApplicable("it sends commands to the arm")
        return rig.device.send(JointCommand(requested_rad))

    def _go(self, rig: ArmCommandRig, end_rad: JointVector) -> AppliedCommand:
        """Move the arm to a pose in steps of one tick; return the result of the last command."""
        begin_rad = rig.home_rad if rig.position_rad is None else _where(rig)
        applied = AppliedCommand(begin_rad)
        for requested_rad in ramp(begin_rad, end_rad, rig.step_rad):
            applied = self._send(rig, requested_rad)
            rig.pass_time(TICK_NS - 1)
        return applied

    def test_turned_by_hand_it_stays_where_it_is_activated(self) -> None:
        """When activated, an arm that was moved by hand while inactive keeps its position."""
        with self.rig(Life.ACTIVE) as rig:
            turn = parameter(rig.turn_by_hand, "turn_by_hand")
            self.use(rig)
            rig.device.deactivate()
            there_rad = _fast_steps(rig)[-1]
            turn(there_rad)
            rig.advance(1)
            rig.device.activate()
            rig.advance(rig.settle_ticks)
            _require_at("turned by hand", _where(rig), there_rad, rig.tolerance_rad)

    def test_position_limit_is_applied_and_reported(self) -> None:
        """When commanded beyond a joint limit, the arm stops at the limit and reports POSITION_LIMIT."""
        with self.rig(Life.CONSTRUCTED) as rig:
            limits = _limits_in_reach(rig)
        for joint, limit_rad, beyond_rad in limits:
            with self.rig(Life.ACTIVE) as rig:
                self._check_limit(rig, joint, limit_rad, beyond_rad)

    def _check_limit(self, rig: ArmCommandRig, joint: int, limit_rad: float, beyond_rad: float) -> None:
        clause, end = "position limit", tuple(beyond_rad if i == joint else q for i, q in enumerate(rig.home_rad))
        # The target moves in small steps, because an arm without limits would jump to a distant target.
        for requested in chain(ramp(rig.home_rad, end, rig.step_rad), repeat(end, rig.limit_ticks)):
            applied = self._send(rig, requested)
            _require_within(clause, rig, applied.position_rad, 0.0)
            if abs(requested[joint] - rig.home_rad[joint]) > abs(limit_rad - rig.home_rad[joint]):
                at_limit = abs(applied.position_rad[joint] - limit_rad) <= rig.tolerance_rad
                if at_limit and applied.reason is CommandReason.POSITION_LIMIT:
                    break
                # The velocity limit may delay the arm on its path to the position limit.
                require(clause, applied.reason is not CommandReason.AS_REQUESTED, f"{applied}", "another reason")
            rig.advance(1)
        else:
            wanted = f"joint {joint} at {limit_rad} rad with POSITION_LIMIT within {rig.limit_ticks} ticks"
            raise ContractViolation(clause, f"{applied}", wanted)
        if rig.position_rad is not None:
            rig.advance(rig.settle_ticks)
            _require_within("really at the limit", rig, rig.position_rad(), rig.tolerance_rad)
        back_rad = next(ramp(applied.position_rad, rig.home_rad, rig.step_rad))
        applied = self._send(rig, back_rad)
        _require_at("away from the limit", applied.position_rad, back_rad, rig.tolerance_rad)

    def test_velocity_limit_is_applied_and_reported(self) -> None:
        """A joint step that is too fast is shortened and reported by ``send``, even if sent repeatedly in one tick."""
        with self.rig(Life.CONSTRUCTED) as rig:
            ends = _fast_steps(rig)
        for end in ends:
            with self.rig(Life.ACTIVE) as rig:
                for _ in range(1 if rig.runs_by_itself else 5):
                    applied = self._send(rig, end)
                    way_rad = _far(applied.position_rad, rig.home_rad)
                    slow = applied.reason is CommandReason.VELOCITY_LIMIT and way_rad < rig.fast_step_rad
                    forward = _far(applied.position_rad, end) <= rig.fast_step_rad
                    wanted = f"less than {rig.fast_step_rad} rad towards {end} rad, with VELOCITY_LIMIT"
                    require("velocity limit", slow and forward, f"{applied}", wanted)

    def test_wrong_number_of_joints_is_refused(self) -> None:
        """A command with too few or too many joints raises CommandError, and no joint moves."""
        with self.rig(Life.ACTIVE) as rig:
            self.use(rig)
            elsewhere = _shifted(rig.home_rad, rig.step_rad)
            self.rest(rig)
            for angles in (elsewhere[:-1], (*elsewhere, 0.0)):
                wanted = f"CommandError for {len(angles)} angles on {len(rig.home_rad)} joints"
                require_raises("joints", CommandError, partial(rig.device.send, JointCommand(angles)), wanted)
                rig.advance(rig.settle_ticks)
                self.rest(rig)

    def test_newest_command_wins(self) -> None:
        """If several commands arrive in one tick, only the last one is executed, and no backlog remains."""
        with self.rig(Life.ACTIVE) as rig:
            parameter(rig.position_rad, "position_rad")
            # More commands are sent than there are ticks to settle, so a queue cannot be empty at the first check.
            for _ in range(rig.settle_ticks + 5):
                self._send(rig, _shifted(rig.home_rad, rig.step_rad))
            applied = self._send(rig, _shifted(rig.home_rad, -rig.step_rad))
            for _ in range(3):
                rig.advance(rig.settle_ticks)
                _require_at("newest command", _where(rig), applied.position_rad, rig.tolerance_rad)

    def test_stop_works_in_every_state(self) -> None:
        """In any state, even while disconnected, repeated ``stop`` calls open nothing, raise nothing and never hang."""
        for life, cut in (*((life, False) for life in Life), (Life.ACTIVE, True)):
            with self.rig(Life.CONSTRUCTED) as rig:
                if (life is Life.FAULTED and rig.provoke_fault is None) or (cut and rig.disconnect is None):
                    continue
                bring(rig, life)
                was_open = rig.is_open is None or rig.is_open()
                if cut:
                    parameter(rig.disconnect, "disconnect")()
                for _ in range(2):
                    start_ns, wall_ns = rig.clock.now_ns(), perf_counter_ns()
                    rig.device.stop()
                    spent_ns, wall_ns = rig.clock.now_ns() - start_ns, perf_counter_ns() - wall_ns
                    quick = spent_ns <= rig.stop_budget_ns and wall_ns <= max(rig.stop_budget_ns, _HANG_NS)
                    observed = f"{spent_ns} ns, {wall_ns} ns of real time"
                    require("stop", quick, observed, f"at most {rig.stop_budget_ns} ns (stop_budget_ns)")
                    rig.pass_time(rig.timeout_ns)
                require("stop", cut or rig.device.life is life, f"{rig.device.life} after stop()", str(life))
                opened = rig.is_open is not None and rig.is_open() and not was_open
                require("stop", not opened, "a resource that it opened", "stop() to open nothing")

    def test_stop_works_from_another_thread(self) -> None:
        """``stop`` works from any thread and has taken effect when it returns."""
        with self.rig(Life.ACTIVE) as rig:
            returned: list[Exception | None] = []

            def stop() -> None:
                try:
                    returned.append(rig.device.stop())
                except Exception as error:
                    returned.append(error)

            thread = Thread(target=stop, daemon=True)
            thread.start()
            for _ in range(LONG_TICKS):
                thread.join(_JOIN_S)
                if not thread.is_alive():
                    break
                # The stop may have to wait for simulated time.
                rig.advance(1)
            require("another thread", returned == [None], f"{returned}", "stop() to return")
            requested_rad = _shifted(rig.home_rad, rig.step_rad)
            _require_stopped(self._send(rig, requested_rad), requested_rad)

    def test_after_stop_the_arm_holds_still(self) -> None:
        """After ``stop`` the arm holds its position, and ``send`` reports STOPPED and applies nothing."""
        with self.rig(Life.ACTIVE) as rig:
            self.work(rig)
            self.start_work(rig)
            self.disturb(rig)
            self.rest(rig)
            for ticks in (1, LONG_TICKS, 1):
                requested_rad = self._next_pose(rig)
                applied = self._send(rig, requested_rad)
                _require_stopped(applied, requested_rad)
                rig.advance(ticks)
                if self._rest_rad:
                    _require_at("stopped", applied.position_rad, self._rest_rad, 2.0 * rig.tolerance_rad)
                self.rest(rig)
            rig.device.deactivate()
            rig.device.activate()
            rig.advance(rig.settle_ticks)
            self.rest(rig)


def _limits_in_reach(rig: ArmCommandRig) -> list[tuple[int, float, float]]:
    """Return the limits to test, nearest first, each as joint, limit, and an angle beyond the limit."""
    limits = zip(rig.home_rad, rig.lower_rad, rig.upper_rad, strict=True)
    rooms = sorted(
        (abs(limit_rad - q), joint, limit_rad, outward)
        for joint, (q, lower, upper) in enumerate(limits)
        for limit_rad, outward in ((lower, -1.0), (upper, 1.0))
    )
    most_rad = _MANY_STEPS * rig.step_rad
    return [
        (joint, limit_rad, limit_rad + outward * rig.step_rad)
        for k, (way_rad, joint, limit_rad, outward) in enumerate(rooms)
        if k == 0 or way_rad <= most_rad
    ]


def _fast_steps(rig: ArmCommandRig) -> list[JointVector]:
    """Return the poses after a step that is too fast, for each joint and direction with enough room."""
    ends = [
        _shifted(rig.home_rad, step, joint)
        for joint, (q, lower, upper) in enumerate(zip(rig.home_rad, rig.lower_rad, rig.upper_rad, strict=True))
        for step in (rig.fast_step_rad, -rig.fast_step_rad)
        if lower <= q + step <= upper
    ]
    require("rig", bool(ends), f"no room for {rig.fast_step_rad} rad", "a joint with room for fast_step_rad")
    return ends


def _where(rig: ArmCommandRig) -> JointVector:
    """Return the joint angles in any adapter state."""
    position_rad = parameter(rig.position_rad, "position_rad")
    try:
        return position_rad()
    except Exception as error:
        raise ClauseNotApplicable(f"position_rad cannot be read while {rig.device.life.value}: {error}") from error


def _far(one_rad: JointVector, other_rad: JointVector) -> float:
    """Return the maximum joint distance between two poses."""
    return max((abs(a - b) for a, b in zip(one_rad, other_rad, strict=True)), default=0.0)


def _shifted(angles: JointVector, shift_rad: float, joint: int | None = None) -> JointVector:
    """Return the angles with one joint, or all joints, moved by ``shift_rad``."""
    return tuple(q + shift_rad if joint in (None, i) else q for i, q in enumerate(angles))


def _require_at(clause: str, found_rad: JointVector, expected_rad: JointVector, tolerance_rad: float) -> None:
    near = len(found_rad) == len(expected_rad) and _far(found_rad, expected_rad) <= tolerance_rad
    require(clause, near, f"{found_rad} rad", f"{expected_rad} rad within {tolerance_rad} rad")


def _require_within(clause: str, rig: ArmCommandRig, found_rad: JointVector, tolerance_rad: float) -> None:
    limits = zip(found_rad, rig.lower_rad, rig.upper_rad, strict=True)
    within = all(lower - tolerance_rad <= q <= upper + tolerance_rad for q, lower, upper in limits)
    require(clause, within, f"{found_rad} rad", f"angles between {rig.lower_rad} and {rig.upper_rad} rad")


def _require_stopped(applied: AppliedCommand, requested_rad: JointVector) -> None:
    held = applied.reason is CommandReason.STOPPED and applied.position_rad != requested_rad
    require("stopped", held, f"{applied}", "STOPPED, with the angles at which the arm is held")
