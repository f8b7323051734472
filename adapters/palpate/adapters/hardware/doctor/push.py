"""Check the signs of the wrench while a person pushes the tool."""

from collections.abc import Callable
from math import hypot
from statistics import fmean
from typing import Final, Protocol

from palpate.adapters.hardware.doctor.findings import DeviceReport, Level, Topic
from palpate.adapters.hardware.doctor.measure import listen
from palpate.core.ports import Clock, ForceSensor

PUSH_N: Final = 3.0
"""Force change that counts as a push."""
TIMEOUT_S: Final = 20.0
"""Maximum time to wait for a push."""
_HELD_S: Final = 0.3
_MEAN_S: Final = 0.7
_READ_NS: Final = 5_000_000
_ALONG: Final = 0.8
_LEVER_M: Final = 0.01
_SKEW: Final = 0.3
"""Torque along a sideways push, divided by that across it, above which axes are swapped (17 degrees)."""


class Person(Protocol):
    """A person at a terminal."""

    def ask(self, question: str) -> str | None:
        """Ask a question and return the answer, or None if there is no person."""

    def notify(self, text: str) -> None:
        """Print a line for the person."""


class PushCheck:
    """Check that asks a person to push the tool and evaluates the measured forces."""

    def __init__(self, sensor: ForceSensor, clock: Clock, person: Person, report: DeviceReport) -> None:
        self._sensor, self._clock, self._person, self._report = sensor, clock, person, report
        self._rest: tuple[float, ...] = (0.0,) * 6

    def run(self) -> None:
        """Ask for pushes, measure the forces, and evaluate them."""
        if self._person.ask("Let the tool hang free, pointing straight down, and press Enter: ") is None:
            self._report.add(Level.WRONG, Topic.PUSH, "no one answered, the signs are not checked", "use a terminal")
            return
        self._rest = self._mean(_MEAN_S)
        self._push()
        self._push_sideways()

    def _push(self) -> None:
        self._person.notify(f"Push the tip of the tool straight up with {2 * PUSH_N:g} N or more for a few seconds.\n")
        change = self._changed(PUSH_N)
        if change is None:
            return
        text = f"a push on the tip changed Fz by {change[2]:+.2f} N"
        if abs(change[2]) < _ALONG * hypot(*change[:3]):
            remedy = "push along the tool's axis; if you did, z of the sensor is not that axis"
            self._report.add(Level.WRONG, Topic.PUSH, f"{text} of {hypot(*change[:3]):.2f} N in all", remedy)
            return
        remedy = "Fz must become negative; the sensor is mounted upside down, or reports what the tool exerts"
        self._report.judge(Topic.SIGN, change[2] < 0.0, text, remedy)

    def _push_sideways(self) -> None:
        self._person.notify("Let go of the tool.\n")
        if not self._wait(lambda force_N: force_N < 0.5 * PUSH_N):
            remedy = "check whether the tool touches something"
            self._report.add(Level.NOTE, Topic.PUSH, "the force did not return to where it was", remedy)
            return
        self._rest = self._mean(_MEAN_S)
        self._person.notify("Push its tip sideways, in any direction.\n")
        change = self._changed(PUSH_N)
        if change is None:
            return
        fx, fy, _, tx, ty, _ = change
        # A force F at r = (0, 0, L) makes the torque r x F = (-L Fy, L Fx, 0), across F; mirrored axes make L < 0.
        across = fx**2 + fy**2
        lever_m, skew_m = (ty * fx - tx * fy) / max(across, 1e-9), abs(tx * fx + ty * fy) / max(across, 1e-9)
        text = f"a sideways push acts {lever_m * 1e3:+.0f} mm from the sensor along its z"
        if max(abs(lever_m), skew_m) < _LEVER_M or across < (_ALONG * hypot(*change[:3])) ** 2:
            self._report.add(Level.NOTE, Topic.AXES, f"{text}, too near or not across", "push at the tip, across")
            return
        remedy = "the axes are mirrored or swapped; set [force_sensor] axes to the other value, or correct the adapter"
        self._report.judge(Topic.AXES, lever_m > max(_LEVER_M, skew_m / _SKEW), text, remedy)

    def _changed(self, least_N: float) -> tuple[float, ...] | None:
        """Return the mean change, (6,) in N and N m, after a sustained change in force."""
        if not self._wait(lambda force_N: force_N >= least_N):
            remedy = "push harder; if nothing ever changes, check the sensor's cable and overload"
            text = f"the force did not change by {least_N:.1f} N within {TIMEOUT_S:g} s"
            self._report.add(Level.WRONG, Topic.PUSH, text, remedy)
            return None
        now = self._mean(_MEAN_S)
        return tuple(after - before for after, before in zip(now, self._rest, strict=True))

    def _wait(self, wanted: Callable[[float], bool]) -> bool:
        begin_ns = since_ns = self._clock.now_ns()
        while (now_ns := self._clock.now_ns()) - begin_ns < TIMEOUT_S * 1e9:
            wrench = self._read()
            if not wanted(hypot(*(a - b for a, b in zip(wrench[:3], self._rest[:3], strict=True)))):
                since_ns = now_ns
            elif now_ns - since_ns >= _HELD_S * 1e9:
                return True
        return False

    def _mean(self, seconds: float) -> tuple[float, ...]:
        samples = listen(self._sensor.read, self._clock, seconds).samples
        wrenches = [(*sample.force_N, *sample.torque_Nm) for sample in samples]
        return tuple(map(fmean, zip(*wrenches, strict=True)))

    def _read(self) -> tuple[float, ...]:
        sample = self._sensor.read()
        self._clock.sleep_until(self._clock.now_ns() + _READ_NS)
        return (*sample.force_N, *sample.torque_Nm)
