"""The contract of the port :class:`palpate.core.ports.devices.ArmCommand`."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from itertools import chain, repeat
from math import inf, nan
from typing import Final

from palpate.core.errors import CommandError
from palpate.core.ports.contracts.arm_bench import far, limits_in_reach, require_at, shifted, where
from palpate.core.ports.contracts.arm_stops import ArmStopContract
from palpate.core.ports.contracts.device import LONG_TICKS
from palpate.core.ports.contracts.motion import ramp
from palpate.core.ports.contracts.rigs import ArmCommandRig
from palpate.core.ports.contracts.violations import (
    ClauseNotApplicable,
    ContractViolation,
    knob,
    require,
    require_raises,
)
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import AppliedCommand, CommandReason, JointCommand, JointVector

_ONCE_MORE: Final = 5
_FAR: Final = 100.0
"""In fast steps: beyond all limits."""


class ArmCommandContract(ArmStopContract):
    """Every arm keeps these clauses; a subclass makes the rig."""

    def test_small_legal_move_is_applied_as_asked(self) -> None:
        """A small move within the limits is applied exactly as asked, and ``send`` says so."""
        with self._rig(Life.ACTIVE) as rig:
            asked = shifted(rig.home_rad, rig.step_rad)
            applied = self._send(rig, asked)
            unchanged = applied.reason is CommandReason.AS_ASKED and applied.position_rad == asked
            require("legal move", unchanged, f"{applied}", f"{asked} with the reason AS_ASKED")

    def test_activation_does_not_move_the_arm(self) -> None:
        """An arm that was activated but not commanded stays where it is."""
        with self._rig(Life.ACTIVE) as rig:
            knob(rig.position_rad, "position_rad")
            rig.advance(rig.settle_ticks)
            require_at("activation", rig, rig.home_rad)

    def test_each_command_counts(self) -> None:
        """Joint by joint, each of many commands leads the arm to where it says."""
        with self._rig(Life.ACTIVE) as rig:
            knob(rig.position_rad, "position_rad")
            for joint, (q, upper) in enumerate(zip(rig.home_rad, rig.upper_rad, strict=True)):
                step_rad = rig.step_rad if q + rig.step_rad <= upper else -rig.step_rad
                away_rad = shifted(rig.home_rad, step_rad, joint)
                for asked in (away_rad, rig.home_rad):
                    self._send(rig, asked)
                    rig.advance(rig.settle_ticks)
                    require_at("each command", rig, asked)
                # Small ones lead there, too.
                for asked in ramp(rig.home_rad, away_rad, 0.25 * abs(step_rad)):
                    self._send(rig, asked)
                    rig.advance(1)
                rig.advance(rig.settle_ticks)
                require_at("small commands", rig, away_rad)
                self._send(rig, rig.home_rad)
                rig.advance(rig.settle_ticks)

    def test_position_limit_is_applied_and_told(self) -> None:
        """Told to go beyond a joint limit, the arm goes up to it, never further, and says POSITION_LIMIT."""
        with self._rig(Life.CONSTRUCTED) as rig:
            limits = limits_in_reach(rig)
        for limit in limits:
            self._check_limit(*limit)
        # Beside the nearest, another joint beyond a limit of its own.
        for joint, _, beyond_rad in limits[1:]:
            if joint != limits[0][0]:
                self._check_limit(*limits[0], {joint: beyond_rad})
                break

    def _check_limit(
        self, joint: int, limit_rad: float, beyond_rad: float, beside_rad: Mapping[int, float] | None = None
    ) -> None:
        with self._rig(Life.ACTIVE) as rig:
            clause, ends_rad = "position limit", {**(beside_rad or {}), joint: beyond_rad}
            end = tuple(ends_rad.get(i, q) for i, q in enumerate(rig.home_rad))
            # Never a jump: an arm that does not keep its limits would make it.
            way = ramp(rig.home_rad, end, rig.step_rad)
            for asked in chain(way, repeat(end, rig.limit_ticks)):
                applied = self._send(rig, asked)
                _require_within(clause, rig, applied.position_rad, 0.0)
                if abs(asked[joint] - rig.home_rad[joint]) > abs(limit_rad - rig.home_rad[joint]):
                    at_limit = abs(applied.position_rad[joint] - limit_rad) <= rig.tolerance_rad
                    if at_limit and applied.reason is CommandReason.POSITION_LIMIT:
                        break
                    # On its way to the limit the arm may be held back by the velocity limit.
                    require(clause, applied.reason is not CommandReason.AS_ASKED, f"{applied}", "another reason")
                rig.advance(1)
            else:
                wanted = f"joint {joint} at {limit_rad} rad with POSITION_LIMIT within {rig.limit_ticks} ticks"
                raise ContractViolation(clause, f"{applied}", wanted)
            for _ in range(_ONCE_MORE):
                _require_within(clause, rig, self._send(rig, end).position_rad, 0.0)
                rig.advance(1)
            if rig.position_rad is not None:
                rig.advance(rig.settle_ticks)
                _require_within("really at the limit", rig, rig.position_rad(), rig.tolerance_rad)
            back_rad = next(ramp(applied.position_rad, rig.home_rad, rig.step_rad))
            applied = self._send(rig, back_rad)
            free = far(applied.position_rad, back_rad) <= rig.tolerance_rad
            require("away from the limit", free, f"{applied}", f"{back_rad} rad")

    def test_velocity_limit_is_applied_and_told(self) -> None:
        """A step that is too fast, of one joint or all, is shortened, and ``send`` says VELOCITY_LIMIT, each time."""
        with self._rig(Life.CONSTRUCTED) as rig:
            ends = _fast_steps(rig)
        for end in ends:
            with self._rig(Life.ACTIVE) as rig:
                for stopped in (False, False, True):
                    if stopped:
                        rig.arm.stop()
                        self._activate_again(rig)
                        # No haste is saved up in a pause.
                        rig.advance(LONG_TICKS if end == ends[-1] else 1)
                    # Within a tick it goes no further, however often it is asked.
                    for _ in range(1 if rig.runs_by_itself else 10):
                        applied = self._send(rig, end)
                        if not (stopped and applied.reason is CommandReason.STOPPED):
                            _require_shortened(applied, rig.home_rad, end)
                    if applied.reason is CommandReason.STOPPED:
                        break  # has a clause of its own
                    rig.advance(1)
                    on = tuple(home + _FAR * (q - home) for home, q in zip(rig.home_rad, end, strict=True))
                    if not rig.runs_by_itself:
                        found_rad = self._send(rig, on).position_rad
                        way_rad = far(found_rad, applied.position_rad)
                        wanted = f"less than {rig.fast_step_rad} rad in the next tick, too"
                        require("velocity limit", way_rad < rig.fast_step_rad, f"{way_rad} rad", wanted)
                        ways = zip(applied.position_rad, found_rad, on, strict=True)
                        back = any((found - q) * (to - q) < 0.0 for q, found, to in ways)
                        require("velocity limit", not back, f"{found_rad} rad", f"the way to {on} rad")
                    rig.advance(rig.settle_ticks)
                    for _ in range(3):
                        self._send(rig, rig.home_rad)
                        rig.advance(rig.settle_ticks)

    def test_turned_by_hand_it_stays_where_it_is_activated(self) -> None:
        """Turned by hand while it is not active, the arm stays there when activated, and limits count from there."""
        with self._rig(Life.ACTIVE) as rig:
            turn = knob(rig.turn_by_hand, "turn_by_hand")
            self._send(rig, rig.home_rad)
            rig.advance(rig.settle_ticks)
            rig.arm.deactivate()
            there_rad = _fast_steps(rig)[-1]
            turn(there_rad)
            rig.advance(1)
            rig.arm.activate()
            rig.advance(rig.settle_ticks)
            require_at("turned by hand", rig, there_rad)
            if rig.motion is None:
                _require_shortened(self._send(rig, rig.home_rad), there_rad, rig.home_rad)

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
                self._send(rig, shifted(rig.home_rad, rig.step_rad))
            applied = self._send(rig, shifted(rig.home_rad, -rig.step_rad))
            for _ in range(3):
                rig.advance(rig.settle_ticks)
                require_at("newest command", rig, applied.position_rad)

    def test_refused_command_moves_nothing(self) -> None:
        """A command that is refused - wrong number of joints, not active, faulted, closed - never moves a joint."""
        for life in (Life.ACTIVE, Life.CONFIGURED, Life.FAULTED, Life.CLOSED):
            with self._rig(Life.ACTIVE) as rig:
                if life is Life.FAULTED and rig.provoke_fault is None:
                    continue
                self._send(rig, rig.home_rad)  # not applicable where nothing may be sent
                rig.advance(rig.settle_ticks)
                asked_rad = shifted(rig.home_rad, rig.step_rad)
                if life is Life.CONFIGURED:
                    rig.arm.deactivate()
                elif life is Life.CLOSED:
                    rig.arm.close()
                elif rig.provoke_fault is not None and life is Life.FAULTED:
                    rig.provoke_fault()
                before_rad = where(rig)
                with suppress(Exception):
                    rig.arm.send(JointCommand((*asked_rad, 0.0) if life is Life.ACTIVE else asked_rad))
                rig.advance(rig.settle_ticks)
                require_at(f"refused while {life.value}", rig, before_rad)
                if life is Life.CLOSED:
                    continue
                self._activate_again(rig)
                rig.advance(rig.settle_ticks)
                require_at(f"activated, after it was refused while {life.value}", rig, before_rad)


def _fast_steps(rig: ArmCommandRig) -> list[JointVector]:
    """Where the fast step leads, of each joint that has room for it, to either side, and of all these together."""
    limits = zip(rig.home_rad, rig.lower_rad, rig.upper_rad, strict=True)
    steps = {
        joint: [step for step in (rig.fast_step_rad, -rig.fast_step_rad) if lower <= q + step <= upper]
        for joint, (q, lower, upper) in enumerate(limits)
    }
    ends = [shifted(rig.home_rad, step, joint) for joint, each in steps.items() for step in each]
    if not ends:
        raise ContractViolation("rig", f"no room for {rig.fast_step_rad} rad", "a joint with room for fast_step_rad")
    together = (q + (steps[joint][0] if steps[joint] else 0.0) for joint, q in enumerate(rig.home_rad))
    return [*ends, tuple(together)]


def _require_shortened(applied: AppliedCommand, home_rad: JointVector, end_rad: JointVector) -> None:
    clause = "velocity limit"
    require(clause, applied.reason is CommandReason.VELOCITY_LIMIT, f"{applied}", "VELOCITY_LIMIT")
    for home, end, found in zip(home_rad, end_rad, applied.position_rad, strict=True):
        if end != home:
            share = (found - home) / (end - home)
            observed = f"{share:.3f} of the step of {end - home} rad"
            require(clause, 0.0 <= share < 1.0, observed, "a shorter step in the same direction")


def _require_within(clause: str, rig: ArmCommandRig, found_rad: JointVector, tolerance_rad: float) -> None:
    within = _is_within(rig, found_rad, tolerance_rad)
    require(clause, within, f"{found_rad} rad", f"angles between {rig.lower_rad} and {rig.upper_rad} rad")


def _is_within(rig: ArmCommandRig, found_rad: JointVector, tolerance_rad: float) -> bool:
    limits = zip(found_rad, rig.lower_rad, rig.upper_rad, strict=True)
    return all(lower - tolerance_rad <= q <= upper + tolerance_rad for q, lower, upper in limits)
