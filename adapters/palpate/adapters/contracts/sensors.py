"""The contracts for the :class:`ForceSensor` and :class:`JointEncoder` ports of :mod:`palpate.core.ports.devices`."""

from abc import abstractmethod
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from math import ceil, inf, pi
from operator import attrgetter
from typing import Any, ClassVar, Final, TypeAlias, TypeVar

from typing_extensions import override

from palpate.adapters.contracts.bench import (
    ClauseNotApplicable,
    ForceSensorRig,
    JointEncoderRig,
    SensorRig,
    parameter,
    ramp,
    require,
)
from palpate.adapters.contracts.device import DeviceContract, bring
from palpate.core.errors import DeviceError
from palpate.core.ports import JointCommand, JointSample, JointVector, Life, Validity, Vector3, WrenchSample

_RUN_TICKS: Final = 280
_SILENT_TICKS: Final = 30
_TIMEOUT_TICKS: Final = 200
_MANY_TOLERANCES: Final = 8.0
_PLAUSIBLE_RAD: Final = 4.0 * pi
"""Maximum plausible joint angle; angles in degrees quickly exceed it."""
_NOTHING: Final = (0.0, 0.0, 0.0)
_SHARES: Final = (0.5, -0.7, -0.9)
"""Load components as fractions, chosen to distinguish every axis and sign."""

_Load: TypeAlias = Callable[[float, float, float], None]
_Side: TypeAlias = tuple[_Load, Callable[[WrenchSample], Vector3], float, float, float]
_Vector: TypeAlias = tuple[str, int, float, float]
"""Name, length, bound on each component, and half the maximum difference between readings under the same load."""
SensorRigT = TypeVar("SensorRigT", bound=SensorRig[Any])


class SampleContract(DeviceContract[SensorRigT]):
    """Clauses for samples from any sensor."""

    sample_type: ClassVar[type]
    _last: Any = None

    @override
    @contextmanager
    def rig(self, life: Life) -> Iterator[SensorRigT]:
        self._last = None
        with super().rig(life) as rig:
            yield rig

    @override
    def use(self, rig: SensorRigT) -> object:
        return rig.device.read()

    def work(self, rig: SensorRigT) -> None:
        """Require a valid sample that is newer than the previous one and, under the same load, equal to it."""
        self._load(rig)
        rig.advance(rig.settle_ticks)
        sample = rig.device.read()
        self._require_sound(rig, sample)
        if self._last is not None:
            self._require_order(self._last, sample)
            self._require_same("same world", rig, self._last, sample)
        self._last = sample

    def _load(self, rig: SensorRigT) -> None:
        """Apply a load to the sensor, if the rig can do so."""

    @abstractmethod
    def _vectors(self, rig: SensorRigT) -> tuple[_Vector, ...]:
        """Return the vectors in a sample."""

    def _require_same(self, clause: str, rig: SensorRigT, one: Any, other: Any) -> None:
        for name, _, _, tolerance in self._vectors(rig):
            found, wanted = getattr(other, name), getattr(one, name)
            require(clause, _near(found, wanted, 2.0 * tolerance), f"{name} = {found}", f"{wanted} as before")

    def test_every_sample_is_sound(self) -> None:
        """Samples have the right type, are finite and recent, and have increasing timestamps."""
        with self.rig(Life.ACTIVE) as rig:
            last = rig.device.read()
            for _ in range(_RUN_TICKS):
                rig.advance(1)
                sample, again = rig.device.read(), rig.device.read()
                self._require_sound(rig, sample)
                self._require_order(last, sample)
                # If the world runs by itself, a new sample may arrive between two readings.
                require("no news", rig.runs_by_itself or again == sample, f"{again} after {sample}", "the same again")
                last = sample

    def _require_order(self, last: Any, sample: Any) -> None:
        newer = sample.sequence > last.sequence and sample.source_time_ns > last.source_time_ns
        stamps = [f"sequence {one.sequence} at {one.source_time_ns} ns" for one in (sample, last)]
        require("order of samples", newer or sample == last, " after ".join(stamps), "a new number for a new sample")

    def _require_sound(self, rig: SensorRigT, sample: Any) -> None:
        kind = self.sample_type
        require("sample", isinstance(sample, kind), f"a {type(sample).__name__}", f"a {kind.__name__}")
        for name in ("source_time_ns", "receive_time_ns", "sequence"):
            value = getattr(sample, name, None)
            require("stamps", type(value) is int, f"{name} = {value!r}", "an int")
        source_ns, receive_ns, now_ns = sample.source_time_ns, sample.receive_time_ns, rig.clock.now_ns()
        observed = f"source {source_ns}, receive {receive_ns}, now {now_ns} ns"
        require("times", source_ns <= receive_ns <= now_ns, observed, "source <= receive <= now")
        young = sample.validity in (Validity.VALID, Validity.SATURATED) and now_ns - source_ns <= rig.max_age_ns
        observed = f"a sample, {sample.validity}, {now_ns - source_ns} ns old"
        require("age", young, observed, f"VALID or SATURATED, at most {rig.max_age_ns} ns old")
        for name, length, most, _ in self._vectors(rig):
            vector = getattr(sample, name)
            sound = isinstance(vector, tuple) and len(vector) == length
            sound = sound and all(isinstance(x, float) and abs(x) < most for x in vector)
            require("sample", sound, f"{name} = {vector!r}", f"a tuple of {length} finite floats below {most:.3g}")

    def test_silence_is_marked(self) -> None:
        """When the newest sample is too old, ``read`` raises DeviceError or marks it STALE, without waiting."""
        with self.rig(Life.ACTIVE) as rig:
            go_silent = parameter(rig.go_silent, "go_silent")
            stale = rig.device.read()
            go_silent()
            rig.pass_time(rig.max_age_ns)
            for _ in range(_SILENT_TICKS):
                with suppress(DeviceError):
                    sample = rig.device.read()
                    marked = sample.validity in (Validity.STALE, Validity.INVALID)
                    require("silence", marked, f"{sample}", f"STALE or DeviceError after {rig.max_age_ns} ns")
                    if sample.sequence == stale.sequence:
                        same = replace(sample, validity=stale.validity) == stale
                        require("silence", same, f"{sample} after {stale}", "the same sample but for its validity")
                    stale = sample
                rig.advance(1)
            self.require_quick("silence", rig)


class ForceSensorContract(SampleContract[ForceSensorRig]):
    """Clauses for every force/torque sensor; a subclass supplies the rig."""

    sample_type = WrenchSample

    def _load(self, rig: ForceSensorRig) -> None:
        if rig.twist_Nm is not None:
            rig.twist_Nm(*(share * rig.load_Nm for share in _SHARES))
        if rig.push_N is not None:
            rig.push_N(*(share * rig.load_N for share in _SHARES))

    def _vectors(self, rig: ForceSensorRig) -> tuple[_Vector, ...]:
        # If the rig cannot apply a load, the load on the tool is unknown.
        tolerance_N = rig.tolerance_N if rig.push_N else inf
        tolerance_Nm = rig.tolerance_Nm if rig.push_N and rig.twist_Nm else inf
        return ("force_N", 3, inf, tolerance_N), ("torque_Nm", 3, inf, tolerance_Nm)

    def _require_sound(self, rig: ForceSensorRig, sample: Any) -> None:
        super()._require_sound(rig, sample)
        declared = (sample.kind, sample.frame) == (rig.kind, rig.frame)
        require("sample", declared, f"{sample.kind}, frame {sample.frame!r}", f"{rig.kind}, frame {rig.frame!r}")

    def test_load_has_its_sign_axis_and_unit(self) -> None:
        """A known load changes only its own component, by its value in N or N m and with the correct sign.

        A surface that presses on the tool tip, against the tool axis, makes Fz more negative.
        """
        with self.rig(Life.ACTIVE) as rig:
            for act, part, safe, _, tolerance in _sides(rig):
                free = part(_settled(rig, act, _NOTHING))
                for load in _each_way(safe):
                    change = _minus(part(_settled(rig, act, load)), free)
                    near = _near(change, load, tolerance)
                    require("load", near, f"a change of {change}", f"{load} within {tolerance}")

    def test_what_is_beyond_the_range_is_marked(self) -> None:
        """An overload is reported in full or marked, and has no effect on later samples."""
        with self.rig(Life.ACTIVE) as rig:
            sides = [side for side in _sides(rig) if side[3]]
            if not sides:
                raise ClauseNotApplicable("this rig has no overload_N or overload_Nm")
            for act, part, safe, most, tolerance in sides:
                free = part(_settled(rig, act, _NOTHING))
                most_error = 3.0 * tolerance * most / safe
                for overload in _each_way(most):
                    for load, error in ((overload, most_error), (_NOTHING, 2.0 * tolerance)):
                        sample = _settled(rig, act, load)
                        change = _minus(part(sample), free)
                        is_right = _near(change, load, error) or sample.validity is not Validity.VALID
                        require("range", is_right, f"a change of {change}, VALID", f"{load}, or another validity")

    def test_no_hidden_tare(self) -> None:
        """A load applied before ``configure`` is reported like one applied later."""
        with self.rig(Life.ACTIVE) as rig:
            _settled(rig, parameter(rig.push_N, "push_N"), _NOTHING)
            self.work(rig)
            later = self._last
        with self.rig(Life.CONSTRUCTED) as rig:
            self._load(rig)
            bring(rig, Life.ACTIVE)
            rig.advance(rig.settle_ticks)
            # Comparing two readings under the same load allows for the sensor's weight and offset.
            self._require_same("tare", rig, later, rig.device.read())


class JointEncoderContract(SampleContract[JointEncoderRig]):
    """Clauses for every joint encoder; a subclass supplies the rig."""

    sample_type = JointSample

    def _vectors(self, rig: JointEncoderRig) -> tuple[_Vector, ...]:
        return (("position_rad", rig.joints, _PLAUSIBLE_RAD, rig.tolerance_rad),)

    def test_angles_are_where_the_joints_stand(self) -> None:
        """The reported angles equal the known joint angles."""
        with self.rig(Life.ACTIVE) as rig:
            _require_there(rig, parameter(rig.expected_rad, "expected_rad"), rig.tolerance_rad, ticks=0)

    def test_encoders_follow_each_joint(self) -> None:
        """A joint motion appears in full in that joint's encoder and in no other, but not before the next tick."""
        with self.rig(Life.ACTIVE) as rig:
            if not self.may_command:
                raise ClauseNotApplicable("it moves the arm")
            arm = _moving_arm(rig)
            here = home = rig.expected_rad or rig.device.read().position_rad
            way_rad = rig.step_rad * max(1, ceil(_MANY_TOLERANCES * rig.tolerance_rad / rig.step_rad))
            if not rig.runs_by_itself:
                here = tuple(q + rig.step_rad for q in home)
                arm.send(JointCommand(here))
                _require_there(rig, home, 0.5 * rig.step_rad, ticks=0)
                rig.advance(1)
            for joint in range(-1, len(home)):  # the first target is home
                end = tuple(q + way_rad * (k == joint) for k, q in enumerate(home))
                for requested in ramp(here, end, rig.step_rad):
                    arm.send(JointCommand(requested))
                    rig.advance(1)
                here = end
                _require_there(rig, end, max(2.0 * rig.tolerance_rad, 0.25 * way_rad), ticks=_TIMEOUT_TICKS)


def _moving_arm(rig: JointEncoderRig) -> Any:
    """Return the arm that moves these joints, active and stationary."""
    arm = parameter(rig.arm, "arm")
    if arm.life is Life.CONSTRUCTED:
        arm.configure()
    if arm.life is Life.CONFIGURED:
        arm.activate()
    rig.advance(1)
    return arm


def _require_there(rig: JointEncoderRig, expected: JointVector, tolerance_rad: float, ticks: int) -> None:
    """Fail the clause unless the encoder reads these angles immediately or within a number of ticks."""
    found = rig.device.read().position_rad
    while ticks and not _near(found, expected, tolerance_rad):
        rig.advance(1)
        found, ticks = rig.device.read().position_rad, ticks - 1
    near = _near(found, expected, tolerance_rad)
    require("each joint", near, f"{found} rad", f"{expected} rad within {tolerance_rad} rad")


def _sides(rig: ForceSensorRig) -> list[_Side]:
    """Return each kind of load as a control, a sample getter, a safe load, an overload and a tolerance."""
    push, force, torque = parameter(rig.push_N, "push_N"), attrgetter("force_N"), attrgetter("torque_Nm")
    sides: list[_Side] = [(push, force, rig.load_N, rig.overload_N or 0.0, rig.tolerance_N)]
    if rig.twist_Nm is not None:
        sides.append((rig.twist_Nm, torque, rig.load_Nm, rig.overload_Nm or 0.0, rig.tolerance_Nm))
    return sides


def _settled(rig: ForceSensorRig, act: _Load, load: Vector3) -> WrenchSample:
    act(*load)
    rig.advance(rig.settle_ticks)
    return rig.device.read()


def _minus(one: Vector3, other: Vector3) -> Vector3:
    x, y, z = (a - b for a, b in zip(one, other, strict=True))
    return (x, y, z)


def _near(one: Sequence[float], other: Sequence[float], tolerance: float) -> bool:
    return all(abs(b - a) <= tolerance for a, b in zip(one, other, strict=True))


def _each_way(load: float) -> list[Vector3]:
    """Return loads along x, y and z in both directions."""
    return [(x * way, y * way, z * way) for way in (load, -load) for x, y, z in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
