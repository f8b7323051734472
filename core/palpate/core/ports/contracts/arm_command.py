"""The contract of the port :class:`palpate.core.ports.devices.ArmCommand`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from itertools import chain, repeat
from math import inf, nan
from typing import ClassVar, Final

from typing_extensions import override

from palpate.core.errors import CommandError
from palpate.core.ports.contracts.device import DeviceContract, pass_time
from palpate.core.ports.contracts.motion import ramp
from palpate.core.ports.contracts.rigs import ArmCommandRig
from palpate.core.ports.contracts.violations import (
    ClauseNotApplicable,
    ContractViolation,
    knob,
    require,
    require_quiet,
    require_raises,
)
from palpate.core.ports.devices import ArmCommand
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import CONTROL_RATE_HZ, AppliedCommand, CommandReason, JointCommand, JointVector

_TICK_NS: Final = 10**9 // CONTROL_RATE_HZ


class ArmCommandContract(DeviceContract[ArmCommandRig]):
    """Every arm keeps these clauses; a subclass makes the rig."""

    PORT: ClassVar[type] = ArmCommand

    _asked_rad: JointVector = ()
    _tick_rad: JointVector = ()
    _tick_ns: int = 0

    @override
    def _use(self, rig: ArmCommandRig) -> object:
        return self._send(rig, rig.home_rad if rig.motion is None else _standing(rig))

    @override
    @contextmanager
    def _rig(self, life: Life) -> Iterator[ArmCommandRig]:
        """Besides: an arm that somebody could stand beside goes home along a ramp before a clause, and after it."""
        with super()._rig(life) as rig:
            self._asked_rad = ()
            may_move = rig.motion is not None and bool(rig.motion.rate_rad_s)
            if may_move and life is Life.ACTIVE:
                self._go(rig, rig.home_rad)
            try:
                yield rig
            finally:
                if may_move and rig.arm.life is Life.ACTIVE:
                    # What a clause has found counts, not whether the way back was free; the next begins with a ramp.
                    with suppress(Exception):
                        self._go(rig, rig.home_rad)

    @staticmethod
    def plan(rig: ArmCommandRig) -> list[str]:
        """What the clauses would move within the rig's limits, how far and how fast; one line each."""
        motion = rig.motion
        if motion is None or not motion.rate_rad_s:
            return ["nothing: no command is sent to the arm"]
        joint, limit_rad, beyond_rad = _nearest_limit(rig)
        way = abs(beyond_rad - rig.home_rad[joint])
        lines = [
            f"at first and before each clause, from where the arm stands to home_rad, if no joint is more than"
            f" {motion.reach_rad:g} rad away from it",
            f"all {len(rig.home_rad)} joints by {rig.step_rad:.4g} rad to either side of home_rad",
        ]
        if way <= motion.reach_rad:
            lines.append(f"joint {joint + 1} by {way:.4g} rad, to its limit at {limit_rad:g} rad and past it")
        return [*lines, f"all of it along ramps of at most {motion.rate_rad_s:g} rad/s a joint"]

    def _send(self, rig: ArmCommandRig, asked_rad: JointVector) -> AppliedCommand:
        """The one way by which clauses command the arm.

        Raises:
            ClauseNotApplicable: It would move further or faster than the rig allows.
        """
        motion = rig.motion
        if motion is None:
            return rig.arm.send(JointCommand(asked_rad))
        if not motion.rate_rad_s:
            raise ClauseNotApplicable("it sends commands to the arm")
        now_ns = rig.clock.now_ns()
        if not self._asked_rad or now_ns - self._tick_ns >= _TICK_NS:
            self._tick_rad, self._tick_ns = self._asked_rad or _standing(rig), now_ns
        for way, most, what in (
            (_far(asked_rad, self._tick_rad), motion.tick_rad, "within a tick"),
            (_far(asked_rad, rig.home_rad), motion.reach_rad, "from home"),
        ):
            if way > most + rig.tolerance_rad:
                raise ClauseNotApplicable(f"it asks for {way:.4g} rad {what}, {most:.4g} rad are allowed")
        self._asked_rad = asked_rad
        return rig.arm.send(JointCommand(asked_rad))

    def _go(self, rig: ArmCommandRig, end_rad: JointVector) -> AppliedCommand:
        """Lead the arm to a pose, step by step, a tick each; what became of the last one."""
        begin_rad = self._asked_rad or (rig.home_rad if rig.motion is None else _standing(rig))
        applied = AppliedCommand(begin_rad)
        for asked_rad in ramp(begin_rad, end_rad, rig.step_rad):
            applied = self._send(rig, asked_rad)
            pass_time(rig, _TICK_NS - 1)
        return applied

    def test_small_legal_move_is_applied_as_asked(self) -> None:
        """A small move within the limits is applied exactly as asked, and ``send`` says so."""
        with self._rig(Life.ACTIVE) as rig:
            asked = _shifted(rig.home_rad, rig.step_rad)
            applied = self._send(rig, asked)
            unchanged = applied.reason is CommandReason.AS_ASKED and applied.position_rad == asked
            require("legal move", unchanged, f"{applied}", f"{asked} with the reason AS_ASKED")

    def test_arm_goes_where_it_was_told(self) -> None:
        """After the applied command has settled, the arm stands there."""
        with self._rig(Life.ACTIVE) as rig:
            knob(rig.position_rad, "position_rad")
            applied = self._send(rig, _shifted(rig.home_rad, rig.step_rad))
            rig.advance(rig.settle_ticks)
            _require_at("obedience", rig, applied.position_rad)

    def test_activation_does_not_move_the_arm(self) -> None:
        """An arm that was activated but not commanded stays where it is."""
        with self._rig(Life.ACTIVE) as rig:
            knob(rig.position_rad, "position_rad")
            rig.advance(rig.settle_ticks)
            _require_at("activation", rig, rig.home_rad)

    def test_position_limit_is_applied_and_told(self) -> None:
        """Told to go beyond a joint limit, the arm goes up to it, never further, and says POSITION_LIMIT."""
        with self._rig(Life.ACTIVE) as rig:
            clause = "position limit"
            joint, limit_rad, beyond_rad = _nearest_limit(rig)
            end = _shifted(rig.home_rad, beyond_rad - rig.home_rad[joint], joint)
            # Never a jump: an arm that does not keep its limits would make it.
            way = ramp(rig.home_rad, end, rig.step_rad)
            for asked in chain(way, repeat(end, rig.limit_ticks)):
                applied = self._send(rig, asked)
                _require_within(clause, rig, applied)
                if abs(asked[joint] - rig.home_rad[joint]) > abs(limit_rad - rig.home_rad[joint]):
                    at_limit = abs(applied.position_rad[joint] - limit_rad) <= rig.tolerance_rad
                    if at_limit and applied.reason is CommandReason.POSITION_LIMIT:
                        return
                    # On its way to the limit the arm may be held back by the velocity limit.
                    require(clause, applied.reason is not CommandReason.AS_ASKED, f"{applied}", "another reason")
                rig.advance(1)
            wanted = f"joint {joint} at {limit_rad} rad with POSITION_LIMIT within {rig.limit_ticks} ticks"
            raise ContractViolation(clause, f"{applied}", wanted)

    def test_velocity_limit_is_applied_and_told(self) -> None:
        """A step that is too fast is shortened, in its own direction, and ``send`` says VELOCITY_LIMIT."""
        with self._rig(Life.ACTIVE) as rig:
            clause = "velocity limit"
            joint, step_rad = _fast_step(rig)
            applied = self._send(rig, _shifted(rig.home_rad, step_rad, joint))
            require(clause, applied.reason is CommandReason.VELOCITY_LIMIT, f"{applied}", "VELOCITY_LIMIT")
            share = (applied.position_rad[joint] - rig.home_rad[joint]) / step_rad
            observed = f"{share:.3f} of the step of {step_rad} rad"
            require(clause, 0.0 <= share < 1.0, observed, "a shorter step in the same direction")

    def test_wrong_number_of_joints_is_refused(self) -> None:
        """A command with too few or too many joints raises CommandError."""
        with self._rig(Life.ACTIVE) as rig:
            for angles in (rig.home_rad[:-1], (*rig.home_rad, 0.0)):
                wanted = f"CommandError for {len(angles)} angles on {len(rig.home_rad)} joints"
                if rig.motion is not None and not rig.motion.rate_rad_s:
                    raise ClauseNotApplicable("it sends commands to the arm")
                action = partial(rig.arm.send, JointCommand(angles))
                require_raises("joints", CommandError, action, wanted)

    def test_command_that_is_not_finite_cannot_be_made(self) -> None:
        """No command can be made of NaN or infinity, so none reaches an arm."""
        for bad in (nan, inf, -inf):
            require_raises("finite", CommandError, partial(JointCommand, (0.0, bad)), "CommandError")

    def test_newest_command_wins(self) -> None:
        """Of many commands in one tick the last one counts; the others leave no backlog."""
        with self._rig(Life.ACTIVE) as rig:
            knob(rig.position_rad, "position_rad")
            # More commands than ticks to settle: a queue could not hide by working itself off.
            for _ in range(rig.settle_ticks + 5):
                self._send(rig, _shifted(rig.home_rad, rig.step_rad))
            applied = self._send(rig, _shifted(rig.home_rad, -rig.step_rad))
            for _ in range(3):
                rig.advance(rig.settle_ticks)
                _require_at("newest command", rig, applied.position_rad)

    def test_stop_works_in_every_state(self) -> None:
        """``stop`` never raises, in whatever state the arm is, twice too."""
        for life in (Life.CONSTRUCTED, Life.CONFIGURED, Life.ACTIVE, Life.CLOSED):
            self._check_stop(life)

    def test_stop_works_while_faulted(self) -> None:
        """``stop`` never raises while a fault is latched."""
        self._check_stop(Life.FAULTED)

    def test_after_stop_send_applies_nothing(self) -> None:
        """After ``stop``, ``send`` says STOPPED each time and does not apply what was asked."""
        with self._rig(Life.ACTIVE) as rig:
            rig.arm.stop()
            asked = _shifted(rig.home_rad, rig.step_rad)
            for _ in range(3):
                applied = self._send(rig, asked)
                stopped = applied.reason is CommandReason.STOPPED and applied.position_rad != asked
                require("stopped", stopped, f"{applied}", "STOPPED, with the angles at which the arm is held")
                rig.advance(1)

    def test_after_stop_the_arm_holds_still(self) -> None:
        """After ``stop`` the arm stays where it came to rest, whatever is sent."""
        with self._rig(Life.ACTIVE) as rig:
            position_rad = knob(rig.position_rad, "position_rad")
            self._send(rig, _shifted(rig.home_rad, rig.step_rad))
            rig.arm.stop()
            rig.advance(rig.settle_ticks)
            rest_rad = position_rad()
            for _ in range(3):
                self._send(rig, _shifted(rest_rad, -rig.step_rad))
                rig.advance(rig.settle_ticks)
                _require_at("stopped", rig, rest_rad)

    def test_activating_again_ends_the_stop(self) -> None:
        """A stopped arm accepts commands again after ``deactivate`` and ``activate``."""
        with self._rig(Life.ACTIVE) as rig:
            rig.arm.stop()
            rig.arm.deactivate()
            rig.arm.activate()
            rig.advance(1)
            applied = self._send(rig, _shifted(rig.home_rad, 0.5 * rig.step_rad))
            taken = applied.reason is CommandReason.AS_ASKED
            require("activated again", taken, f"{applied}", "the reason AS_ASKED")

    def _check_stop(self, life: Life) -> None:
        with self._rig(life) as rig:
            for _ in range(2):
                require_quiet("stop", rig.arm.stop, f"stop() to work while {life.value}")


def _standing(rig: ArmCommandRig) -> JointVector:
    """Where the arm stands."""
    return knob(rig.position_rad, "position_rad, without which nobody knows where a ramp begins")()


def _far(one_rad: JointVector, other_rad: JointVector) -> float:
    """The largest distance of a joint between two poses."""
    return max((abs(a - b) for a, b in zip(one_rad, other_rad, strict=True)), default=0.0)


def _shifted(angles: JointVector, shift_rad: float, joint: int | None = None) -> JointVector:
    """The angles with one joint, or all of them, moved by ``shift_rad``."""
    return tuple(q + shift_rad if joint in (None, i) else q for i, q in enumerate(angles))


def _nearest_limit(rig: ArmCommandRig) -> tuple[int, float, float]:
    """The joint that is closest to a limit, that limit, and an angle beyond it."""
    limits = zip(rig.home_rad, rig.lower_rad, rig.upper_rad, strict=True)
    rooms = [
        (abs(limit_rad - q), joint, limit_rad, outward)
        for joint, (q, lower, upper) in enumerate(limits)
        for limit_rad, outward in ((lower, -1.0), (upper, 1.0))
    ]
    _, joint, limit_rad, outward = min(rooms)
    return joint, limit_rad, limit_rad + outward * rig.step_rad


def _fast_step(rig: ArmCommandRig) -> tuple[int, float]:
    """A joint that has room for the fast step, and the step with its sign."""
    limits = zip(rig.home_rad, rig.lower_rad, rig.upper_rad, strict=True)
    for joint, (q, lower, upper) in enumerate(limits):
        for step_rad in (rig.fast_step_rad, -rig.fast_step_rad):
            if lower <= q + step_rad <= upper:
                return joint, step_rad
    raise ContractViolation("rig", f"no room for {rig.fast_step_rad} rad", "a joint with room for fast_step_rad")


def _require_within(clause: str, rig: ArmCommandRig, applied: AppliedCommand) -> None:
    limits = zip(applied.position_rad, rig.lower_rad, rig.upper_rad, strict=True)
    within = all(lower <= q <= upper for q, lower, upper in limits)
    require(clause, within, f"{applied}", f"angles between {rig.lower_rad} and {rig.upper_rad} rad")


def _require_at(clause: str, rig: ArmCommandRig, expected_rad: JointVector) -> None:
    found_rad = knob(rig.position_rad, "position_rad")()
    near = all(abs(q - p) <= rig.tolerance_rad for q, p in zip(found_rad, expected_rad, strict=True))
    require(clause, near, f"the arm at {found_rad} rad", f"{expected_rad} rad within {rig.tolerance_rad} rad")
