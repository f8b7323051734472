"""The contract of the port :class:`palpate.core.ports.devices.ForceSensor`."""

from collections.abc import Callable, Sequence
from math import isfinite
from operator import attrgetter
from typing import Any, ClassVar, Final

from typing_extensions import override

from palpate.core.ports.contracts.device import LONG_TICKS
from palpate.core.ports.contracts.rigs import ForceSensorRig
from palpate.core.ports.contracts.samples import SampleContract, pause
from palpate.core.ports.contracts.violations import knob, require
from palpate.core.ports.devices import ForceSensor
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import Validity, Vector3, WrenchSample

_Load = Callable[[float, float, float], None]
_LEAST_TOLERANCES: Final = 4.0
"""So much of a load is told from noise."""
_NOTHING: Final = (0.0, 0.0, 0.0)
_WORLDS: Final = ((0.5, -0.7, -0.9), (-0.8, 0.4, 0.6), (0.06, -0.05, 0.08))
"""Shares of the load, with every axis and sign told from the others."""


class ForceSensorContract(SampleContract[ForceSensorRig]):
    """Every force/torque sensor keeps these clauses; a subclass makes the rig."""

    PORT: ClassVar[type] = ForceSensor

    @override
    def _change(self, rig: ForceSensorRig, world: int) -> object:
        if rig.push_N is None:
            return None
        if rig.twist_Nm is not None:
            rig.twist_Nm(*(share * rig.load_Nm for share in _WORLDS[world]))
        rig.push_N(*(share * rig.load_N for share in _WORLDS[world]))
        return world

    @override
    def _differs(self, rig: ForceSensorRig, one: WrenchSample, other: WrenchSample) -> str:
        if (one.kind, one.frame) != (other.kind, other.frame):
            return f"{other.kind} in the frame {other.frame!r} after {one.kind} in {one.frame!r}"
        if rig.push_N is None:
            return ""  # what weighs on the tool is anybody's guess
        near = _near(one.force_N, other.force_N, 2.0 * rig.tolerance_N)
        if rig.twist_Nm is not None:
            near = near and _near(one.torque_Nm, other.torque_Nm, 2.0 * rig.tolerance_Nm)
        return "" if near else f"{other.force_N} N, {other.torque_Nm} N m after {one.force_N} N, {one.torque_Nm} N m"

    @override
    def _unsound(self, rig: ForceSensorRig, sample: Any) -> str:
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

    def test_pressing_on_the_tip_gives_negative_fz(self) -> None:
        """A surface that presses on the tool tip, against the tool axis, makes Fz more negative; x and y likewise."""
        with self._rig(Life.ACTIVE) as rig:
            change = _response(rig, (0.0, 0.0, -rig.load_N))
            require("sign", change[2] < 0.0, f"Fz changed by {change[2]:+.3f} N", "a negative change of Fz")
            for axis, force in enumerate(((-rig.load_N, 0.0, 0.0), (0.0, -rig.load_N, 0.0))):
                found_N = _response(rig, force)[axis]
                require("sign", found_N < rig.tolerance_N, f"a change of {found_N:+.3f} N", f"one to {force} N")

    def test_load_is_reported_in_newtons_on_its_axis(self) -> None:
        """A known load along x, y or z, either way, changes that component by as many newtons, and no other.

        Smaller ones do, as long as they are more than noise, and loads along all three at once. Where it is known what
        they act on, their torque is that of the lever.
        """
        with self._rig(Life.ACTIVE) as rig:
            push, half = knob(rig.push_N, "push_N"), 0.5 * rig.load_N
            for force in [*_smaller(rig.load_N, rig.tolerance_N), (half, -half, half)]:
                free, loaded = _settled(rig, push, _NOTHING), _settled(rig, push, force)
                change = tuple(b - a for a, b in zip(free.force_N, loaded.force_N, strict=True))
                # The sign has its own clause, so that a wrong one is not taken for a wrong unit or axis.
                close = all(abs(abs(c) - abs(f)) <= rig.tolerance_N for c, f in zip(change, force, strict=True))
                require("units and axes", close, f"a change of {change} N", f"{force} N")
                if rig.pushed_at_m is not None:
                    (x, y, z), (fx, fy, fz) = rig.pushed_at_m, force
                    torque = (y * fz - z * fy, z * fx - x * fz, x * fy - y * fx)
                    turned = tuple(b - a for a, b in zip(free.torque_Nm, loaded.torque_Nm, strict=True))
                    near = all(abs(t - w) <= rig.tolerance_Nm for t, w in zip(turned, torque, strict=True))
                    require("crosstalk", near, f"a change of {turned} N m with {force} N", f"{torque} N m")

    def test_what_is_beyond_the_range_is_marked(self) -> None:
        """A force beyond ``load_N``, up to ``overload_N``, is reported in full or marked, and leaves nothing."""
        with self._rig(Life.ACTIVE) as rig:
            push, most_N = knob(rig.push_N, "push_N"), knob(rig.overload_N, "overload_N")
            pause(rig)
            self.works(rig)
            _check_range(rig, push, attrgetter("force_N"), (rig.load_N, most_N, rig.tolerance_N))
            for _ in _WORLDS:
                self.works(rig)

    def test_torque_beyond_the_range_is_marked(self) -> None:
        """A torque up to ``overload_Nm``, beside a force too, is reported in full or marked, and leaves nothing."""
        with self._rig(Life.ACTIVE) as rig:
            twist, most_Nm = knob(rig.twist_Nm, "twist_Nm"), knob(rig.overload_Nm, "overload_Nm")
            pause(rig)
            for beside_N in (0.0, rig.overload_N or 0.0):
                if rig.push_N is not None:
                    rig.push_N(0.0, 0.0, -beside_N)
                _check_range(rig, twist, attrgetter("torque_Nm"), (rig.load_Nm, most_Nm, rig.tolerance_Nm))

    def test_torque_is_reported_in_newton_metres_on_its_axis(self) -> None:
        """A known torque about x, y or z, either way, changes that component by as many newton metres, and no other.

        So it does beside a force, whichever its sign.
        """
        with self._rig(Life.ACTIVE) as rig:
            twist = knob(rig.twist_Nm, "twist_Nm")
            pause(rig)
            for k, wanted in enumerate(_smaller(rig.load_Nm, rig.tolerance_Nm)):
                if rig.push_N is not None:
                    rig.push_N(0.0, 0.0, rig.load_N if k % 2 else -rig.load_N)
                free, loaded = (_settled(rig, twist, load).torque_Nm for load in (_NOTHING, wanted))
                close = all(abs(b - a - w) <= rig.tolerance_Nm for a, b, w in zip(free, loaded, wanted, strict=True))
                require("units and axes", close, f"{loaded} N m, {free} N m without load", f"{wanted} N m more")

    def test_no_hidden_tare(self) -> None:
        """A load that stays, is there before ``configure``, or over a pause or fault, is reported like a later one."""
        for world in range(len(_WORLDS)):
            found = []
            with self._rig(Life.ACTIVE) as rig:
                push = knob(rig.push_N, "push_N")
                _settled(rig, push, _NOTHING)
                later = self._in_world(rig, world)
                for _ in range(LONG_TICKS):
                    rig.advance(1)
                    found.append(rig.device.read())
                pause(rig)
                found.append(self._in_world(rig, world))
            with self._rig(Life.CONSTRUCTED) as rig:
                self._change(rig, world)
                rig.device.configure()
                rig.device.activate()
                found.append(self._in_world(rig, world))
                # Comparing two readings under the same load leaves the sensor its weight and offset.
                for sample in found:
                    differs = self._differs(rig, later, sample)
                    require("tare", not differs, differs, "no taring on connect, activate or by itself")

    def _in_world(self, rig: ForceSensorRig, world: int) -> WrenchSample:
        self._change(rig, world)
        rig.advance(rig.settle_ticks)
        return rig.device.read()


def _check_range(
    rig: ForceSensorRig, act: _Load, part: Callable[[WrenchSample], Vector3], least_most_error: Vector3
) -> None:
    least, most, error = least_most_error

    def change() -> Vector3:
        x, y, z = (b - a for a, b in zip(free, part(sample), strict=True))
        return (x, y, z)

    free = part(_settled(rig, act, _NOTHING))
    for load in _each_way(least):
        sample, share = _settled(rig, act, load), 1.0
        usual = change()
        while share * least < most:
            share = min(1.5 * share, most / least)
            sample = _settled(rig, act, tuple(share * x for x in load))
            # Units, axes and signs have clauses of their own.
            for _ in range(2):  # the second time it has been so for a while
                close = all(abs(x - share * y) <= 3.0 * share * error for x, y in zip(change(), usual, strict=True))
                marked = sample.validity is not Validity.VALID
                require("range", close or marked, f"{change()}, VALID", f"{share} times {usual}, or SATURATED")
                sample = _settled(rig, act, tuple(share * x for x in load))
        sample = _settled(rig, act, _NOTHING)
        kept = sample.validity is not Validity.VALID or max(map(abs, change())) <= 2.0 * error
        require("after an overload", kept, f"{change()} without a load, VALID", "nothing, or another validity")


def _near(one: Vector3, other: Vector3, tolerance: float) -> bool:
    return all(abs(b - a) <= tolerance for a, b in zip(one, other, strict=True))


def _each_way(load: float) -> list[Vector3]:
    return [(x * way, y * way, z * way) for way in (load, -load) for x, y, z in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]


def _smaller(load: float, tolerance: float) -> list[Vector3]:
    """A load and, again and again, a tenth of it, either way along each axis."""
    loads = _each_way(load)
    while (load := 0.1 * load) > _LEAST_TOLERANCES * tolerance:
        loads += _each_way(load)
    return loads


def _response(rig: ForceSensorRig, force: Vector3) -> Vector3:
    """By how much a load changes the reading."""
    push = knob(rig.push_N, "push_N")
    free = _reading(rig, push, _NOTHING)
    loaded = _reading(rig, push, force)
    return (loaded[0] - free[0], loaded[1] - free[1], loaded[2] - free[2])


def _reading(rig: ForceSensorRig, push: _Load, force: Vector3) -> Vector3:
    return _settled(rig, push, force).force_N


def _settled(rig: ForceSensorRig, act: _Load, load: Sequence[float]) -> WrenchSample:
    act(*load)
    rig.advance(rig.settle_ticks)
    return rig.device.read()
