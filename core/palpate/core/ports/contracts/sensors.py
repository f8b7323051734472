"""The contracts of the ports :class:`ForceSensor` and :class:`JointEncoder` of :mod:`palpate.core.ports.devices`."""

from abc import abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from math import ceil, isfinite, pi
from operator import attrgetter
from typing import Any, Final, TypeAlias, TypeVar

from typing_extensions import override

from palpate.core.errors import DeviceError
from palpate.core.ports.contracts.bench import (
    ClauseNotApplicable,
    ContractViolation,
    ForceSensorRig,
    JointEncoderRig,
    SensorRig,
    knob,
    require,
)
from palpate.core.ports.contracts.device import DeviceContract
from palpate.core.ports.contracts.motion import ramp
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import (
    AppliedCommand,
    CommandReason,
    JointCommand,
    JointSample,
    JointVector,
    Validity,
    Vector3,
    WrenchSample,
)

_RUN_TICKS: Final = 280
_SILENT_TICKS: Final = 30
_PATIENCE_TICKS: Final = 200
_MANY_TOLERANCES: Final = 8.0
_PLAUSIBLE_RAD: Final = 4.0 * pi
"""No revolute joint of an arm turns further from its zero; degrees soon do."""
_NOTHING: Final = (0.0, 0.0, 0.0)
_SHARES: Final = (0.5, -0.7, -0.9)
"""Of the load: with every axis and sign told from the others."""

_Load: TypeAlias = Callable[[float, float, float], None]
_Side: TypeAlias = tuple[_Load, Callable[[WrenchSample], Vector3], float, float | None, float]
SensorRigT = TypeVar("SensorRigT", bound=SensorRig[Any])


class SampleContract(DeviceContract[SensorRigT]):
    """Clauses on samples, whatever they measure."""

    _first: Any = None
    _last: Any = None

    @override
    @contextmanager
    def rig(self, life: Life) -> Iterator[SensorRigT]:
        self._first = self._last = None
        with super().rig(life) as rig:
            yield rig

    @override
    def use(self, rig: SensorRigT) -> object:
        return rig.device.read()

    @override
    def work(self, rig: SensorRigT) -> None:
        """A sample is sound, newer than any before it, and says the same of the same world."""
        self._load(rig)
        rig.advance(rig.settle_ticks)
        sample = rig.device.read()
        self._require_sound(rig, sample)
        if self._last is not None:
            newer = sample.sequence > self._last.sequence and sample.source_time_ns > self._last.source_time_ns
            require("order of samples", newer, f"{_stamp(sample)} after {_stamp(self._last)}", "a newer sample")
        self._last, self._first = sample, self._first or sample
        found = self._differs(rig, self._first, sample)
        require("as before", not found, found, "the same of the same world, at any time")

    def _load(self, rig: SensorRigT) -> None:
        """Put a load on the sensor, if the rig can."""

    @abstractmethod
    def _differs(self, rig: SensorRigT, one: Any, other: Any) -> str:
        """In what two samples of the same world are not the same; empty where they are."""

    @abstractmethod
    def _fault(self, rig: SensorRigT, sample: Any) -> str:
        """What is wrong with the type, the frame or the numbers of a sample; empty if nothing."""

    def test_every_sample_is_sound(self) -> None:
        """Each tick brings one new sample: of its type, finite, stamped in order and young."""
        with self.rig(Life.ACTIVE) as rig:
            last, missed = rig.device.read(), 0
            for tick in range(_RUN_TICKS):
                rig.advance(1)
                sample, again = rig.device.read(), rig.device.read()
                self._require_sound(rig, sample)
                # Where the world goes on by itself, there may be news between two readings.
                same = again == sample or (rig.runs_by_itself and again.source_time_ns > sample.source_time_ns)
                require("no news", same, f"{again} after {sample}", "the same sample again")
                newer = sample.sequence > last.sequence and sample.source_time_ns > last.source_time_ns
                observed = f"{_stamp(sample)} after {_stamp(last)}"
                require("order of samples", newer or sample == last, observed, "a new number for a new sample")
                missed, last = missed + (not newer), again
                # A live device may occasionally miss a tick.
                allowed = 1 + tick // 50 if rig.runs_by_itself else 0
                require("news", missed <= allowed, f"{observed}, {missed} times so", "a new sample each tick")

    def _require_sound(self, rig: SensorRigT, sample: Any) -> None:
        for name in ("source_time_ns", "receive_time_ns", "sequence"):
            value = getattr(sample, name, None)
            whole = isinstance(value, int) and not isinstance(value, bool)
            require("stamps", whole, f"{name} = {value!r}", "an int")
        source_ns, receive_ns, now_ns = sample.source_time_ns, sample.receive_time_ns, rig.clock.now_ns()
        observed = f"source {source_ns}, receive {receive_ns}, now {now_ns} ns"
        require("times", source_ns <= receive_ns <= now_ns, observed, "source <= receive <= now")
        young = sample.validity in (Validity.VALID, Validity.SATURATED) and now_ns - source_ns <= rig.max_age_ns
        observed = f"a sample, {sample.validity}, {now_ns - source_ns} ns old"
        require("age", young, observed, f"VALID or SATURATED, at most {rig.max_age_ns} ns old")
        fault = self._fault(rig, sample)
        require("sample", not fault, fault, "the types, units and frame of the port")

    def test_silence_is_marked(self) -> None:
        """Once the newest sample is over age, reading raises DeviceError or gives it marked STALE, without waiting."""
        with self.rig(Life.ACTIVE) as rig:
            go_silent = knob(rig.go_silent, "go_silent")
            stale = rig.device.read()
            go_silent()
            rig.pass_time(rig.max_age_ns)
            for _ in range(_SILENT_TICKS):
                with suppress(DeviceError):
                    sample = rig.device.read()
                    marked = sample.validity in (Validity.STALE, Validity.INVALID)
                    observed = f"a {sample.validity.value} sample ({_stamp(sample)})"
                    require("silence", marked, observed, f"STALE or DeviceError after {rig.max_age_ns} ns")
                    if sample.sequence == stale.sequence:
                        same = replace(sample, validity=stale.validity) == stale
                        require("silence", same, f"{sample} after {stale}", "the same sample but for its validity")
                    stale = sample
                rig.advance(1)
            self.require_quick("silence", rig)


class ForceSensorContract(SampleContract[ForceSensorRig]):
    """Every force/torque sensor keeps these clauses; a subclass makes the rig."""

    @override
    def _load(self, rig: ForceSensorRig) -> None:
        if rig.twist_Nm is not None:
            rig.twist_Nm(*(share * rig.load_Nm for share in _SHARES))
        if rig.push_N is not None:
            rig.push_N(*(share * rig.load_N for share in _SHARES))

    @override
    def _differs(self, rig: ForceSensorRig, one: WrenchSample, other: WrenchSample) -> str:
        if rig.push_N is None:
            return ""  # the load on the tool is not known
        near = _near(one.force_N, other.force_N, 2.0 * rig.tolerance_N)
        if rig.twist_Nm is not None:
            near = near and _near(one.torque_Nm, other.torque_Nm, 2.0 * rig.tolerance_Nm)
        return "" if near else f"{other.force_N} N, {other.torque_Nm} N m after {one.force_N} N, {one.torque_Nm} N m"

    @override
    def _fault(self, rig: ForceSensorRig, sample: Any) -> str:
        if not isinstance(sample, WrenchSample):
            return f"a {type(sample).__name__}"
        for name, vector in (("force_N", sample.force_N), ("torque_Nm", sample.torque_Nm)):
            if not (isinstance(vector, tuple) and len(vector) == 3 and all(isinstance(x, float) for x in vector)):
                return f"{name} = {vector!r} instead of a tuple of 3 floats"
            if not all(map(isfinite, vector)):
                return f"{name} = {vector!r} in a {sample.validity.value} sample"
        if (sample.kind, sample.frame) != (rig.kind, rig.frame):
            return f"{sample.kind}, frame {sample.frame!r} instead of {rig.kind}, frame {rig.frame!r}"
        return ""

    def test_load_has_its_sign_axis_and_unit(self) -> None:
        """A known load changes its own component by as many N or N m, sign included, and no other component.

        A surface that presses on the tool tip, against the tool axis, makes Fz more negative.
        """
        with self.rig(Life.ACTIVE) as rig:
            for act, part, load, _, tolerance in _sides(rig):
                half = 0.5 * load
                for one in (*_each_way(load), *_each_way(0.1 * load), (half, -half, half)):
                    free = part(_settled(rig, act, _NOTHING))
                    change = _minus(part(_settled(rig, act, one)), free)
                    require("load", _near(change, one, tolerance), f"a change of {change}", f"{one} within {tolerance}")

    def test_what_is_beyond_the_range_is_marked(self) -> None:
        """A load beyond the safe one, up to the overload, is reported in full or marked, and leaves nothing behind."""
        with self.rig(Life.ACTIVE) as rig:
            sides = [side for side in _sides(rig) if side[3] is not None]
            if not sides:
                raise ClauseNotApplicable("this rig has no overload_N or overload_Nm")
            for act, part, load, most, error in sides:
                for one in _each_way(load):
                    free, share = part(_settled(rig, act, _NOTHING)), 1.0
                    usual = _minus(part(_settled(rig, act, one)), free)
                    while share * load < (most or 0.0):
                        share = min(1.5 * share, (most or 0.0) / load)
                        sample = _settled(rig, act, _scaled(one, share))
                        near = _near(_minus(part(sample), free), _scaled(usual, share), 3.0 * share * error)
                        marked = sample.validity is not Validity.VALID
                        require(
                            "range", near or marked, f"{part(sample)}, VALID", f"{share} times {usual}, or SATURATED"
                        )
                    sample = _settled(rig, act, _NOTHING)
                    kept = sample.validity is not Validity.VALID or _near(part(sample), free, 2.0 * error)
                    require("after an overload", kept, f"{part(sample)}, VALID", f"{free}, or another validity")

    def test_no_hidden_tare(self) -> None:
        """A load that is there before ``configure``, or over a pause or a fault, is reported like a later one."""
        with self.rig(Life.ACTIVE) as rig:
            _settled(rig, knob(rig.push_N, "push_N"), _NOTHING)
            self.work(rig)
            later = self._first
            rig.device.deactivate()
            rig.pass_time(rig.max_age_ns)
            self.revive(rig)
            if rig.provoke_fault is not None:
                rig.provoke_fault()
                self.revive(rig)
        with self.rig(Life.CONSTRUCTED) as rig:
            self._load(rig)
            rig.device.configure()
            rig.device.activate()
            rig.advance(max(1, rig.settle_ticks))
            # Comparing two readings under the same load leaves the sensor its weight and offset.
            differs = self._differs(rig, later, rig.device.read())
            require("tare", not differs, differs, "no taring on connect or activate")


class JointEncoderContract(SampleContract[JointEncoderRig]):
    """Every joint encoder keeps these clauses; a subclass makes the rig."""

    @override
    def _differs(self, rig: JointEncoderRig, one: JointSample, other: JointSample) -> str:
        pairs = zip(one.position_rad, other.position_rad, strict=True)
        near = all(abs(p - q) <= 2.0 * rig.tolerance_rad for p, q in pairs)
        return "" if near else f"{other.position_rad} rad after {one.position_rad} rad"

    @override
    def _fault(self, rig: JointEncoderRig, sample: Any) -> str:
        if not isinstance(sample, JointSample):
            return f"a {type(sample).__name__}"
        angles = sample.position_rad
        if not (isinstance(angles, tuple) and len(angles) == rig.joints and all(isinstance(x, float) for x in angles)):
            return f"position_rad = {angles!r} instead of a tuple of {rig.joints} floats"
        if not all(abs(q) <= _PLAUSIBLE_RAD for q in angles):
            return f"position_rad = {angles!r}: not finite, or more than two turns"
        return ""

    def test_angles_are_where_the_joints_stand(self) -> None:
        """The angles are those at which the joints are known to stand."""
        with self.rig(Life.ACTIVE) as rig:
            expected, found = knob(rig.expected_rad, "expected_rad"), rig.device.read().position_rad
            near = all(abs(q - p) <= rig.tolerance_rad for q, p in zip(found, expected, strict=True))
            require("angles", near, f"{found} rad", f"{expected} rad within {rig.tolerance_rad} rad")

    def test_observation_does_not_depend_on_the_command_of_its_tick(self) -> None:
        """A command changes nothing that is read in the same tick, whether read before or only after it."""
        for read_before in (True, False):
            with self.rig(Life.ACTIVE) as rig:
                if rig.runs_by_itself:
                    raise ClauseNotApplicable("this rig's world does not wait between two calls")
                arm, here = _moving_arm(rig), rig.device.read().position_rad
                rig.advance(1)
                before = rig.device.read() if read_before else None
                arm.send(JointCommand(tuple(q + rig.step_rad for q in here)))
                after = rig.device.read()
                near = all(abs(q - p) < 0.5 * rig.step_rad for q, p in zip(after.position_rad, here, strict=True))
                require("causality", near and before in (None, after), f"{after} after {before or here}", "no change")

    def test_encoders_follow_each_joint(self) -> None:
        """When the arm moves one joint, the encoder of that joint turns the same way as far, and no other does."""
        with self.rig(Life.ACTIVE) as rig:
            arm = _moving_arm(rig)
            if rig.motion is not None:
                knob(rig.expected_rad, "expected_rad, without which it is not known where a ramp begins")
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


def _moving_arm(rig: JointEncoderRig) -> Any:
    """The arm of these joints, active and stationary."""
    if rig.motion is not None and not rig.motion.rate_rad_s:
        raise ClauseNotApplicable("it moves the arm")
    arm = knob(rig.arm, "arm")
    if arm.life is Life.CONSTRUCTED:
        arm.configure()
    if arm.life is Life.CONFIGURED:
        arm.activate()
    rig.advance(1)
    return arm


def _require_there(rig: JointEncoderRig, expected: JointVector, tolerance_rad: float) -> None:
    for _ in range(_PATIENCE_TICKS):
        found = rig.device.read().position_rad
        if all(abs(q - p) <= tolerance_rad for q, p in zip(found, expected, strict=True)):
            return
        rig.advance(1)
    raise ContractViolation("each joint", f"{found} rad", f"{expected} rad within {tolerance_rad} rad, as sent")


def _sides(rig: ForceSensorRig) -> list[_Side]:
    """How the rig acts on forces and torques: knob, part of the sample, safe load, overload, tolerance."""
    push, force, torque = knob(rig.push_N, "push_N"), attrgetter("force_N"), attrgetter("torque_Nm")
    sides: list[_Side] = [(push, force, rig.load_N, rig.overload_N, rig.tolerance_N)]
    if rig.twist_Nm is not None:
        sides.append((rig.twist_Nm, torque, rig.load_Nm, rig.overload_Nm, rig.tolerance_Nm))
    return sides


def _settled(rig: ForceSensorRig, act: _Load, load: Vector3) -> WrenchSample:
    act(*load)
    rig.advance(rig.settle_ticks)
    return rig.device.read()


def _minus(one: Vector3, other: Vector3) -> Vector3:
    x, y, z = (a - b for a, b in zip(one, other, strict=True))
    return (x, y, z)


def _scaled(vector: Vector3, factor: float) -> Vector3:
    x, y, z = vector
    return (factor * x, factor * y, factor * z)


def _near(one: Vector3, other: Vector3, tolerance: float) -> bool:
    return all(abs(b - a) <= tolerance for a, b in zip(one, other, strict=True))


def _each_way(load: float) -> list[Vector3]:
    """A load along x, y and z, and against them."""
    return [(x * way, y * way, z * way) for way in (load, -load) for x, y, z in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]


def _stamp(sample: WrenchSample | JointSample) -> str:
    return f"sequence {sample.sequence} at {sample.source_time_ns} ns"
