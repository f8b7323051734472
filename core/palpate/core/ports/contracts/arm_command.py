"""The contract of the port :class:`palpate.core.ports.devices.ArmCommand`."""

from collections.abc import Iterator, Mapping
from functools import partial
from itertools import chain, repeat
from math import inf, nan
from typing import Final

from palpate.core.errors import CommandError
from palpate.core.ports.contracts.arm_bench import far, fast_steps, limits_in_reach, require_at, shifted
from palpate.core.ports.contracts.arm_stops import ArmStopContract
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
_LEAST: Final = 24
"""Commands of a long run at least, however long each takes to settle."""
_LEAST_TOLERANCES: Final = 4.0
"""So much of a move is told from none."""
_FAR: Final = 100.0
"""In fast steps: beyond all limits."""
_HASTE: Final = 1.5
"""So much further than the tick before is too far."""


class ArmCommandContract(ArmStopContract):
    """Every arm keeps these clauses; a subclass makes the rig."""

    def test_activation_does_not_move_the_arm(self) -> None:
        """An arm that was activated but not commanded stays where it is; and so it does after a command, for long."""
        with self._rig(Life.ACTIVE) as rig:
            knob(rig.position_rad, "position_rad")
            for commanded in (False, True):
                there_rad = self._beside(rig, 0) if commanded else rig.home_rad
                if commanded:
                    self._go(rig, rig.home_rad)
                    self._send(rig, rig.home_rad)
                    rig.advance(1)
                    self._go(rig, there_rad)
                for ticks in (rig.settle_ticks, rig.rest_ticks):
                    rig.advance(ticks)
                    require_at("not commanded", rig, there_rad)

    def test_each_command_counts(self) -> None:
        """Over a long run each of many commands, to any joints, leads where it says, and ``send`` says the same."""
        with self._rig(Life.ACTIVE) as rig:
            knob(rig.position_rad, "position_rad")
            # First one joint at a time, from home and back, and there in smaller and smaller steps, too.
            home_rad, aside = rig.home_rad, [self._beside(rig, joint) for joint in range(len(rig.home_rad))]
            poses = chain.from_iterable((there, home_rad, *_nearer(rig, there), home_rad) for there in aside)
            turns = max(_LEAST, rig.long_ticks // rig.settle_ticks)
            for turn in range(turns):
                asked_rad = next(poses, ()) or self._somewhere(rig)
                applied = self._go(rig, asked_rad, arrive=False)
                told = applied.reason is CommandReason.AS_ASKED and applied.position_rad == asked_rad
                require("legal move", told, f"{applied}", f"{asked_rad} with the reason AS_ASKED")
                self._rest_rad = asked_rad
                rig.advance(rig.settle_ticks)
                require_at(f"command {turn + 1}", rig, asked_rad)
                allowed = 1 + turn // 50 if rig.runs_by_itself else 0
                require(
                    "time of a call",
                    self._late <= allowed,
                    f"{self._late} too long",
                    f"{rig.call_budget_ns} ns at most",
                )

    def _beside(self, rig: ArmCommandRig, joint: int) -> JointVector:
        """Home, but for one joint, on the side on which there is room."""
        inside = rig.home_rad[joint] + rig.step_rad <= rig.upper_rad[joint]
        return shifted(rig.home_rad, rig.step_rad if inside else -rig.step_rad, joint)

    def test_position_limit_is_applied_and_told(self) -> None:
        """Told to go beyond a joint limit, the arm goes up to it, never further, and says POSITION_LIMIT."""
        with self._rig(Life.CONSTRUCTED) as rig:
            limits = limits_in_reach(rig)
        for number, limit in enumerate(limits):
            # The nearest by an arm that is new, the others by one that has lived.
            self._check_limit(*limit, lived=number > 0)
        # Beside the nearest, another joint beyond a limit of its own.
        for joint, _, beyond_rad in limits[1:]:
            if joint != limits[0][0]:
                self._check_limit(*limits[0], {joint: beyond_rad}, lived=True)
                break

    def _check_limit(
        self,
        joint: int,
        limit_rad: float,
        beyond_rad: float,
        beside_rad: Mapping[int, float] | None = None,
        *,
        lived: bool,
    ) -> None:
        with self._rig(Life.ACTIVE) as rig:
            if lived:
                self._live(rig)
            clause, ends_rad = "position limit", {**(beside_rad or {}), joint: beyond_rad}
            end = tuple(ends_rad.get(i, q) for i, q in enumerate(rig.home_rad))
            # Never a jump: an arm that does not keep its limits would make it.
            way = ramp(rig.home_rad, end, rig.step_rad)
            for asked in chain(way, repeat(end, rig.limit_ticks)):
                applied = self._send(rig, asked)
                if lived and applied.reason is CommandReason.STOPPED:
                    return  # has a clause of its own
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
            hasty = shifted(end, rig.fast_step_rad if beyond_rad > limit_rad else -rig.fast_step_rad, joint)
            for again in range(_ONCE_MORE):
                asked = hasty if again % 2 and rig.motion is None else end
                _require_within(clause, rig, self._send(rig, asked).position_rad, 0.0)
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
            ends = fast_steps(rig)
        for end in ends:
            with self._rig(Life.ACTIVE) as rig:
                for stopped in (False, False, True):
                    if stopped:
                        self._live(rig)
                        # No haste is saved up in a pause.
                        rig.advance(rig.rest_ticks if end == ends[-1] else 1)
                    # Within a tick it goes no further, however often it is asked.
                    for _ in range(1 if rig.runs_by_itself else 10):
                        applied = self._send(rig, end)
                        if not (stopped and applied.reason is CommandReason.STOPPED):
                            _require_shortened(applied, rig.home_rad, end)
                    if applied.reason is CommandReason.STOPPED:
                        break  # has a clause of its own
                    rig.advance(1)
                    if not rig.runs_by_itself:
                        self._go_on_and_back(rig, applied.position_rad, end)
                    rig.advance(rig.settle_ticks)
                    for _ in range(3):
                        applied = self._send(rig, rig.home_rad)
                        told = applied.reason is not CommandReason.AS_ASKED or applied.position_rad == rig.home_rad
                        require("velocity limit", told, f"{applied}", f"{rig.home_rad} rad as AS_ASKED, or why not")
                        rig.advance(rig.settle_ticks)

    def _go_on_and_back(self, rig: ArmCommandRig, here_rad: JointVector, end_rad: JointVector) -> None:
        """On the way to a pose far beyond all limits, and back in the tick after it, no tick goes too far."""
        clause, most_rad = "velocity limit", rig.fast_step_rad
        for far_away in (_FAR, -_FAR):
            to_rad = tuple(home + far_away * (q - home) for home, q in zip(rig.home_rad, end_rad, strict=True))
            found_rad = self._send(rig, to_rad).position_rad
            way_rad = far(found_rad, here_rad)
            require(clause, way_rad < most_rad, f"{way_rad} rad", f"less than {most_rad} rad in the next tick, too")
            ways = zip(here_rad, found_rad, to_rad, strict=True)
            away = any((found - q) * (to - q) < 0.0 for q, found, to in ways)
            require(clause, not away, f"{found_rad} rad", f"the way to {to_rad} rad")
            rig.advance(1)
            # Once it has come to speed; both ways are told alike.
            here_rad, most_rad = found_rad, min(most_rad, _HASTE * way_rad + rig.tolerance_rad)
        if rig.position_rad is not None:
            rig.advance(rig.settle_ticks)
            require_at(clause, rig, found_rad)

    def test_turned_by_hand_it_stays_where_it_is_activated(self) -> None:
        """Turned by hand while it is not active, the arm stays there when activated, and limits count from there."""
        with self._rig(Life.ACTIVE) as rig:
            turn = knob(rig.turn_by_hand, "turn_by_hand")
            self._send(rig, rig.home_rad)
            rig.advance(rig.settle_ticks)
            rig.device.deactivate()
            there_rad = fast_steps(rig)[-1]
            turn(there_rad)
            rig.advance(1)
            rig.device.activate()
            rig.advance(rig.settle_ticks)
            require_at("turned by hand", rig, there_rad)
            if rig.motion is None:
                _require_shortened(self._send(rig, rig.home_rad), there_rad, rig.home_rad)

    def test_wrong_number_of_joints_is_refused(self) -> None:
        """A command with too few or too many joints raises CommandError, and no joint moves, then or later."""
        with self._rig(Life.ACTIVE) as rig:
            if not self.may_use(rig):
                raise ClauseNotApplicable("it sends commands to the arm")
            elsewhere = shifted(rig.home_rad, rig.step_rad)
            self.rests(rig)
            for angles in (elsewhere[:-1], (*elsewhere, 0.0)):
                wanted = f"CommandError for {len(angles)} angles on {len(rig.home_rad)} joints"
                require_raises("joints", CommandError, partial(rig.device.send, JointCommand(angles)), wanted)
                rig.advance(rig.settle_ticks)
                self.rests(rig)
            self._activate_again(rig)
            rig.advance(rig.settle_ticks)
            self.rests(rig)

    def test_command_that_is_not_finite_cannot_be_made(self) -> None:
        """No command can be made of NaN or infinity, so none reaches an arm."""
        for bad in (nan, inf, -inf):
            require_raises("finite", CommandError, partial(JointCommand, (0.0, bad)), "CommandError")

    def test_newest_command_wins(self) -> None:
        """Of many commands in one tick the last one counts; the others leave no backlog."""
        with self._rig(Life.ACTIVE) as rig:
            knob(rig.position_rad, "position_rad")
            for first, last in ((1.0, -1.0), (-0.5, 0.0)):
                # More commands than ticks to settle: a queue could not hide by working itself off.
                for _ in range(rig.settle_ticks + 5):
                    self._send(rig, shifted(rig.home_rad, first * rig.step_rad))
                applied = self._send(rig, shifted(rig.home_rad, last * rig.step_rad))
                for _ in range(3):
                    rig.advance(rig.settle_ticks)
                    require_at("newest command", rig, applied.position_rad)


def _nearer(rig: ArmCommandRig, there_rad: JointVector) -> Iterator[JointVector]:
    """From home to a pose, half of what is left each time, as long as that is told from standing still."""
    left = 0.5
    while left == 0.5 or left * rig.step_rad >= _LEAST_TOLERANCES * rig.tolerance_rad:
        yield tuple(there + left * (home - there) for home, there in zip(rig.home_rad, there_rad, strict=True))
        left *= 0.5


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
