"""A person pushes the tool: do the signs of the wrench come out as the core expects them?"""

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot, isfinite
from statistics import fmean
from typing import Final, Protocol

from palpate.adapters.hardware.doctor.findings import Notebook
from palpate.core.ports import Clock, ForceSensor

PUSH_N: Final = 3.0
"""Change of force that counts as a push."""
PATIENCE_S: Final = 20.0
"""How long to wait for it."""
_G: Final = 9.81
_HELD_S: Final = 0.3
_SETTLE_S: Final = 2.0
_MEAN_S: Final = 0.7
_READ_NS: Final = 5_000_000
_ALONG: Final = 0.8
_SCALE: Final = 0.1
_LEVER_M: Final = 0.01
_ASK: Final = (
    "Let the tool hang free, pointing straight down, and press Enter; or type the mass in kg of a weight\n"
    "that you will hang on it, and press Enter: "
)


class Person(Protocol):
    """Somebody at a terminal."""

    def ask(self, question: str) -> str | None:
        """The answer; None when nobody is there."""

    def tell(self, text: str) -> None:
        """Say something."""


@dataclass(frozen=True)
class Change:
    """By how much the wrench has changed, in N and N m."""

    Fx: float
    Fy: float
    Fz: float
    Mx: float
    My: float
    Mz: float

    @property
    def force_N(self) -> float:
        """Magnitude of the change of force."""
        return hypot(self.Fx, self.Fy, self.Fz)


class PushCheck:
    """The questions and what follows from the answers."""

    def __init__(self, sensor: ForceSensor, clock: Clock, person: Person, notes: Notebook, mend_axes: str) -> None:
        self._sensor, self._clock, self._person = sensor, clock, person
        self._notes, self._mend_axes = notes, mend_axes
        self._rest: tuple[float, ...] = (0.0,) * 6

    def run(self) -> None:
        """Ask, measure, judge."""
        answer = self._person.ask(_ASK)
        if answer is None:
            remedy = "run palpate doctor --push on a terminal, with somebody at the tool"
            self._notes.wrong("the signs were not checked: nobody answered", remedy)
            return
        mass_kg = _mass(answer)
        if mass_kg is None:
            self._notes.wrong(f"the signs were not checked: {answer!r} is no mass", "type a mass in kg, as in 0.5")
            return
        self._rest = self._mean(_MEAN_S)
        if mass_kg > 0.0:
            self._weigh(mass_kg)
        else:
            self._push()
            self._push_sideways()

    def _push(self) -> None:
        self._person.tell(
            f"Now push the tip of the tool straight up, with {2 * PUSH_N:g} N or more, for some seconds.\n"
        )
        change = self._changed(PUSH_N)
        if change is None:
            return
        told = f"pushing the tip changed Fz by {change.Fz:+.2f} N"
        if abs(change.Fz) < _ALONG * change.force_N:
            remedy = "push along the tool axis; if you did, the sensor's z is not the tool axis: see its mounting"
            self._notes.wrong(f"{told} of {change.force_N:.2f} N in all: the force came from the side", remedy)
            return
        remedy = (
            "z must point out of the tool: the sensor is mounted the other way round, or it tells what the tool "
            "exerts instead of what it feels; the setting axes changes only Fx and Mx"
        )
        self._notes.judge(change.Fz < 0.0, f"{told}, as it must", f"{told}, it must get negative", remedy)

    def _weigh(self, mass_kg: float) -> None:
        wanted_N = mass_kg * _G
        self._person.tell(f"Hang it on the tool now: {wanted_N:.2f} N. Do not touch it then.\n")
        change = self._changed(0.5 * wanted_N, settle_s=_SETTLE_S)
        if change is None:
            return
        told = f"a weight of {wanted_N:.2f} N changed Fz by {change.Fz:+.2f} N"
        if change.Fz < -_ALONG * change.force_N:
            remedy = "the sensor is mounted the other way round, or its z points into the tool; or the tool points up"
            self._notes.wrong(f"{told}: it pulls along the tool axis and must make Fz more positive", remedy)
        elif abs(change.Fz - wanted_N) > _SCALE * wanted_N:
            remedy = "see that the tool points straight down and the weight hangs still; else have it calibrated"
            self._notes.wrong(f"{told}", remedy)
        else:
            self._notes.ok(f"{told}, as it must")

    def _push_sideways(self) -> None:
        self._person.tell("Let go of the tool.\n")
        if not self._wait(lambda force_N: force_N < 0.5 * PUSH_N):
            self._notes.note("the force did not go back to where it was", "see whether the tool touches something")
            return
        self._rest = self._mean(_MEAN_S)
        self._person.tell("Now push its tip sideways, in any direction.\n")
        change = self._changed(PUSH_N)
        if change is None:
            return
        # A force F at the tip, r = (0, 0, L), makes the torque r x F = (-L Fy, L Fx, 0); mirrored axes make L negative.
        across = change.Fx**2 + change.Fy**2
        lever_m = (change.My * change.Fx - change.Mx * change.Fy) / across if across > 0.0 else 0.0
        told = f"a sideways push acts {lever_m * 1e3:+.0f} mm from the sensor along its z"
        if abs(lever_m) < _LEVER_M or across < (_ALONG * change.force_N) ** 2:
            self._notes.note(f"{told}: too near, or not sideways, to tell mirrored axes", "push at the tip, across")
        else:
            self._notes.judge(lever_m > 0.0, f"{told}: the axes are right-handed",
                              f"{told}, on the wrong side: the axes are mirrored", self._mend_axes)  # fmt: skip

    def _changed(self, least_N: float, settle_s: float = 0.0) -> Change | None:
        """The mean change once the force has changed by so much for a while."""
        if not self._wait(lambda force_N: force_N >= least_N):
            remedy = "try again and push harder; if nothing ever changes, look at the sensor's cable and overload"
            self._notes.wrong(f"the force did not change by {least_N:.1f} N within {PATIENCE_S:g} s", remedy)
            return None
        if settle_s:
            self._mean(settle_s)
        now = self._mean(_MEAN_S)
        return Change(*(after - before for after, before in zip(now, self._rest, strict=True)))

    def _wait(self, wanted: Callable[[float], bool]) -> bool:
        begin_ns = since_ns = self._clock.now_ns()
        while (now_ns := self._clock.now_ns()) - begin_ns < PATIENCE_S * 1e9:
            wrench = self._read()
            if not wanted(hypot(*(a - b for a, b in zip(wrench[:3], self._rest[:3], strict=True)))):
                since_ns = now_ns
            elif now_ns - since_ns >= _HELD_S * 1e9:
                return True
        return False

    def _mean(self, seconds: float) -> tuple[float, ...]:
        end_ns, wrenches = self._clock.now_ns() + round(seconds * 1e9), []
        while self._clock.now_ns() < end_ns:
            wrenches.append(self._read())
        return tuple(fmean(channel) for channel in zip(*wrenches, strict=True))

    def _read(self) -> tuple[float, ...]:
        sample = self._sensor.read()
        self._clock.sleep_until(self._clock.now_ns() + _READ_NS)
        return (*sample.force_N, *sample.torque_Nm)


def _mass(answer: str) -> float | None:
    """Kilograms; 0 for an empty answer, None for nonsense."""
    text = answer.strip().removesuffix("kg").replace(",", ".")
    try:
        mass_kg = float(text or 0.0)
    except ValueError:
        return None
    return mass_kg if isfinite(mass_kg) and 0.0 <= mass_kg <= 50.0 else None
