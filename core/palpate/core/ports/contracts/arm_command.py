"""The contract of the port :class:`palpate.core.ports.devices.ArmCommand`."""

from __future__ import annotations

from functools import partial
from math import inf, nan
from typing import ClassVar

from palpate.core.errors import CommandError
from palpate.core.ports.contracts.device import DeviceContract
from palpate.core.ports.contracts.rigs import ArmCommandRig
from palpate.core.ports.contracts.violations import ContractViolation, knob, require, require_quiet, require_raises
from palpate.core.ports.devices import ArmCommand
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import AppliedCommand, CommandReason, JointCommand, JointVector


class ArmCommandContract(DeviceContract[ArmCommandRig]):
    """Every arm keeps these clauses; a subclass makes the rig."""

    PORT: ClassVar[type] = ArmCommand

    def _use(self, rig: ArmCommandRig) -> object:
        return rig.arm.send(JointCommand(rig.home_rad))

    def test_small_legal_move_is_applied_as_asked(self) -> None:
        """A small move within the limits is applied exactly as asked, and ``send`` says so."""
        with self._rig(Life.ACTIVE) as rig:
            asked = _shifted(rig.home_rad, rig.step_rad)
            applied = rig.arm.send(JointCommand(asked))
            unchanged = applied.reason is CommandReason.AS_ASKED and applied.position_rad == asked
            require("legal move", unchanged, f"{applied}", f"{asked} with the reason AS_ASKED")

    def test_arm_goes_where_it_was_told(self) -> None:
        """After the applied command has settled, the arm stands there."""
        with self._rig(Life.ACTIVE) as rig:
            knob(rig.position_rad, "position_rad")
            applied = rig.arm.send(JointCommand(_shifted(rig.home_rad, rig.step_rad)))
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
            asked = _shifted(rig.home_rad, beyond_rad - rig.home_rad[joint], joint)
            for _ in range(rig.limit_ticks):
                applied = rig.arm.send(JointCommand(asked))
                _require_within(clause, rig, applied)
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
            applied = rig.arm.send(JointCommand(_shifted(rig.home_rad, step_rad, joint)))
            require(clause, applied.reason is CommandReason.VELOCITY_LIMIT, f"{applied}", "VELOCITY_LIMIT")
            share = (applied.position_rad[joint] - rig.home_rad[joint]) / step_rad
            observed = f"{share:.3f} of the step of {step_rad} rad"
            require(clause, 0.0 <= share < 1.0, observed, "a shorter step in the same direction")

    def test_wrong_number_of_joints_is_refused(self) -> None:
        """A command with too few or too many joints raises CommandError."""
        with self._rig(Life.ACTIVE) as rig:
            for angles in (rig.home_rad[:-1], (*rig.home_rad, 0.0)):
                wanted = f"CommandError for {len(angles)} angles on {len(rig.home_rad)} joints"
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
                rig.arm.send(JointCommand(_shifted(rig.home_rad, rig.step_rad)))
            applied = rig.arm.send(JointCommand(_shifted(rig.home_rad, -rig.step_rad)))
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
                applied = rig.arm.send(JointCommand(asked))
                stopped = applied.reason is CommandReason.STOPPED and applied.position_rad != asked
                require("stopped", stopped, f"{applied}", "STOPPED, with the angles at which the arm is held")
                rig.advance(1)

    def test_after_stop_the_arm_holds_still(self) -> None:
        """After ``stop`` the arm stays where it came to rest, whatever is sent."""
        with self._rig(Life.ACTIVE) as rig:
            position_rad = knob(rig.position_rad, "position_rad")
            rig.arm.send(JointCommand(_shifted(rig.home_rad, rig.step_rad)))
            rig.arm.stop()
            rig.advance(rig.settle_ticks)
            rest_rad = position_rad()
            for _ in range(3):
                rig.arm.send(JointCommand(_shifted(rest_rad, -rig.step_rad)))
                rig.advance(rig.settle_ticks)
                _require_at("stopped", rig, rest_rad)

    def test_activating_again_ends_the_stop(self) -> None:
        """A stopped arm accepts commands again after ``deactivate`` and ``activate``."""
        with self._rig(Life.ACTIVE) as rig:
            rig.arm.stop()
            rig.arm.deactivate()
            rig.arm.activate()
            rig.advance(1)
            applied = rig.arm.send(JointCommand(_shifted(rig.home_rad, 0.5 * rig.step_rad)))
            taken = applied.reason is CommandReason.AS_ASKED
            require("activated again", taken, f"{applied}", "the reason AS_ASKED")

    def _check_stop(self, life: Life) -> None:
        with self._rig(life) as rig:
            for _ in range(2):
                require_quiet("stop", rig.arm.stop, f"stop() to work while {life.value}")


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
