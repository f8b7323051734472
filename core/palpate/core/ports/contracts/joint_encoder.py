"""The contract of the port :class:`palpate.core.ports.devices.JointEncoder`."""

from math import ceil, pi
from typing import Any, ClassVar, Final

from typing_extensions import override

from palpate.core.ports.contracts.device import activate
from palpate.core.ports.contracts.lives import pass_time, revive
from palpate.core.ports.contracts.motion import ramp
from palpate.core.ports.contracts.rigs import JointEncoderRig
from palpate.core.ports.contracts.samples import SampleContract, pause, standing_world
from palpate.core.ports.contracts.violations import ClauseNotApplicable, ContractViolation, knob, require
from palpate.core.ports.devices import JointEncoder
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import AppliedCommand, CommandReason, JointCommand, JointSample, JointVector

PLAUSIBLE_RAD = 4.0 * pi
"""No revolute joint of an arm turns further from its zero; degrees soon do."""

_MANY_TOLERANCES: Final = 8.0
_PATIENCE_TICKS: Final = 200
_JUMP_RAD: Final = 0.1
_HAND_RAD: Final = 0.5
"""No hand turns a joint further within a tick, so an encoder loses no turn."""


class JointEncoderContract(SampleContract[JointEncoderRig]):
    """Every joint encoder keeps these clauses; a subclass makes the rig."""

    PORT: ClassVar[type] = JointEncoder

    @override
    def _change(self, rig: JointEncoderRig, world: int) -> object:
        # Servos may hold against a hand.
        if rig.turn_by_hand is None or rig.expected_rad is None or len(set(map(id, rig.all_devices))) == 1:
            return None
        way_rad = min(rig.turn_rad, _JUMP_RAD)
        rig.turn_by_hand(tuple(q + way_rad * ((joint + world) % 3 - 1) for joint, q in enumerate(rig.expected_rad)))
        return world

    @override
    def _differs(self, rig: JointEncoderRig, one: JointSample, other: JointSample) -> str:
        pairs = zip(one.position_rad, other.position_rad, strict=True)
        near = all(abs(p - q) <= 2.0 * rig.tolerance_rad for p, q in pairs)
        return "" if near else f"{other.position_rad} rad after {one.position_rad} rad"

    @override
    def _unsound(self, rig: JointEncoderRig, sample: Any) -> str:
        if not isinstance(sample, JointSample):
            return f"a {type(sample).__name__}"
        angles = sample.position_rad
        if not (isinstance(angles, tuple) and len(angles) == rig.joints and all(isinstance(x, float) for x in angles)):
            return f"position_rad = {angles!r} instead of a tuple of {rig.joints} floats"
        plausible = all(abs(q) <= PLAUSIBLE_RAD for q in angles)  # and so finite
        return "" if plausible else f"position_rad = {angles!r} in a {sample.validity.value} sample, two turns at most"

    def test_angles_are_where_the_joints_stand(self) -> None:
        """The angles are those at which the joints are known to stand, after a pause and a fault too."""
        with self._rig(Life.ACTIVE) as rig:
            expected = knob(rig.expected_rad, "expected_rad")
            for paused in (False, True):
                if paused:
                    pause(rig)
                _require_angles("angles", rig, expected)

    def test_angles_follow_a_hand(self) -> None:
        """Joints that are turned by hand, the encoder active, not, or cut off, are reported where they then stand."""
        with self._rig(Life.ACTIVE) as rig:
            turn = knob(rig.turn_by_hand, "turn_by_hand")
            here = home = rig.expected_rad or rig.device.read().position_rad
            little_rad = _MANY_TOLERANCES * rig.tolerance_rad
            for way_rad in (little_rad, rig.turn_rad, -rig.turn_rad):
                rig.device.deactivate()
                cut = rig.disconnect if way_rad < 0.0 and rig.reconnect is not None else None
                if cut is not None:
                    cut()
                if way_rad < 0.0 and rig.arm is not None:
                    rig.arm.stop()  # a stopped arm can be turned, too
                for asked in ramp(here, tuple(q + way_rad for q in home), _HAND_RAD):
                    turn(asked)
                    rig.advance(1)
                here = asked
                if cut is None:
                    rig.device.activate()
                else:
                    knob(rig.reconnect, "reconnect")()
                    revive(rig)
                pass_time(rig, rig.max_age_ns)
                _require_angles("turned while inactive", rig, here)
                if len(set(map(id, rig.all_devices))) == 1:
                    continue  # its servos may hold against it now
                for asked in (*ramp(here, home, _HAND_RAD), tuple(q + little_rad for q in home)):
                    turn(asked)
                    rig.advance(rig.settle_ticks)
                    _require_angles("turned", rig, asked)
                here = asked

    def test_observation_does_not_depend_on_the_command_of_its_tick(self) -> None:
        """A command changes nothing that is read in the same tick, whether read before or only after it."""
        with self._rig(Life.ACTIVE) as rig:
            standing_world(rig)
            _require_leave(rig)
            arm = knob(rig.arm, "arm")
            activate(arm)
            rig.advance(1)
            before = rig.device.read()
            target = JointCommand(tuple(q + rig.step_rad for q in before.position_rad))
            arm.send(target)
            after = rig.device.read()
            require("causality", after == before, f"{after} after {before}", "the same sample after send()")
        with self._rig(Life.ACTIVE) as rig:
            arm = knob(rig.arm, "arm")
            activate(arm)
            rig.advance(1)
            arm.send(target)
            first = rig.device.read()
            near = all(
                abs(q - p) < 0.5 * rig.step_rad for q, p in zip(first.position_rad, before.position_rad, strict=True)
            )
            observed = f"{first.position_rad} rad right after send(), {before.position_rad} rad before"
            require("causality", near, observed, "an observation that does not know of this tick's command")

    def test_encoders_follow_each_joint(self) -> None:
        """When the arm moves one joint, the encoder of that joint turns the same way as far, and no other does."""
        with self._rig(Life.ACTIVE) as rig:
            _require_leave(rig)
            arm = knob(rig.arm, "arm")
            if rig.motion is not None:
                knob(rig.expected_rad, "expected_rad, without which nobody knows where a ramp begins")
            activate(arm)
            rig.advance(1)
            here = home = rig.expected_rad or rig.device.read().position_rad
            way_rad = rig.step_rad * max(1, ceil(_MANY_TOLERANCES * rig.tolerance_rad / rig.step_rad))
            if rig.motion is not None and way_rad > rig.motion.reach_rad:
                raise ClauseNotApplicable(f"it moves each joint by {way_rad:.4g} rad")
            for joint in range(-1, len(home)):  # at first to home itself
                # The other side is for a joint that stands at its limit.
                for end in (tuple(q + way * (k == joint) for k, q in enumerate(home)) for way in (way_rad, -way_rad)):
                    applied = AppliedCommand(here)
                    for asked in ramp(here, end, rig.step_rad):
                        applied = arm.send(JointCommand(asked))
                        rig.advance(1)
                    here = end
                    if applied.reason is CommandReason.AS_ASKED:
                        break
                _require_there(rig, end, max(2.0 * rig.tolerance_rad, 0.25 * way_rad))


def _require_angles(clause: str, rig: JointEncoderRig, expected: JointVector) -> None:
    found = rig.device.read().position_rad
    pairs = zip(found, expected, strict=False)
    near = len(found) == len(expected) and all(abs(q - p) <= rig.tolerance_rad for q, p in pairs)
    require(clause, near, f"{found} rad", f"{expected} rad within {rig.tolerance_rad} rad")


def _require_there(rig: JointEncoderRig, expected: JointVector, tolerance_rad: float) -> None:
    for _ in range(_PATIENCE_TICKS):
        found = rig.device.read().position_rad
        whole = len(found) == len(expected)
        if whole and all(abs(q - p) <= tolerance_rad for q, p in zip(found, expected, strict=True)):
            return
        rig.advance(1)
    raise ContractViolation("each joint", f"{found} rad", f"{expected} rad within {tolerance_rad} rad, as sent")


def _require_leave(rig: JointEncoderRig) -> None:
    if rig.motion is not None and not rig.motion.rate_rad_s:
        raise ClauseNotApplicable("it moves the arm")
