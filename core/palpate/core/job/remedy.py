"""Check whether a job's contacts can be verified, and find remedies if they cannot."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import islice
from math import isfinite, sqrt
from typing import Final

from palpate.core.job.derived import Constants, Quantities, derive
from palpate.core.job.regime import Regime, regime_of
from palpate.core.job.verification import ACROSS, FAIR, MOST_SAMPLES, PUSH_SHARE, Spring

_STEP, _STEPS = 1.05, 48
"""Factor between successive remedies, and number of steps down to a tenth or up to ten times the value."""
_NAMED: Final = 3
"""Maximum number of remedies listed in a message."""
_BUDGET_S: Final = MOST_SAMPLES * Constants().period_s


@dataclass(frozen=True)
class Verification:
    """Contact verification for a job, in SI units.

    Attributes:
        step_m: Standard deviation of the tip position along the tool due to encoder steps.
        press_N: Pressing force set by the user; 0 uses the derived one.
    """

    job: Quantities
    step_m: float
    press_N: float = 0.0

    @property
    def regime(self) -> Regime:
        """Return the regime for the given press."""
        known, found = Constants(), derive(self.job)
        found = replace(found, press_N=self.press_N or found.press_N)
        return regime_of(self.job, found, step_m=self.step_m, known=known)

    @property
    def push_N(self) -> tuple[float, float]:
        """Return the push that reveals the gripper's lateral stiffness, and the maximum push within the budget."""
        job, found = self.job, derive(self.job)
        damping_s = 2.0 * job.damping_ratio * sqrt(job.moving_kg / job.lateral_N_per_m)
        spring = Spring(job.lateral_N_per_m, damping_s, job.rigid_kg, *ACROSS, Constants().period_s)
        return spring.least_dither_N(job.noise_N, self.step_m, FAIR), PUSH_SHARE * (
            job.force_N - found.insertion_press_N
        )

    @property
    def needs_wall(self) -> bool:
        """Return True if a wall must respond during the descent because the full deflection would exceed the budget."""
        return self.job.depth_m * self.job.axial_N_per_m > self.push_N[1] / PUSH_SHARE

    @property
    def is_possible(self) -> bool:
        """Return True if the longest window and the maximum push are sufficient."""
        least_N, most_N = self.push_N
        return self.regime.window_s < 1.001 * _BUDGET_S and (least_N <= most_N or not self.needs_wall)

    @property
    def axis(self) -> str:
        """Return the name of the tool stiffness setting whose response is undetectable."""
        return "axial_N_per_mm" if self.regime.window_s >= 1.001 * _BUDGET_S else "lateral_N_per_mm"

    def refusal(self) -> str:
        """Return the reason why verification is impossible and the cheapest remedies; empty if it is possible."""
        if self.is_possible:
            return ""
        regime, job, (least_N, most_N) = self.regime, self.job, self.push_N
        remedies = " or ".join(islice(self._remedies(), _NAMED)) or "use a quieter sensor and another gripper"
        if self.axis == "lateral_N_per_mm":
            return (
                f"no wall of the hole can be verified: with {1e-3 * job.lateral_N_per_m:.3g} N/mm across this takes a"
                f" push of {least_N:.3g} N, at most {most_N:.3g} N fits the force limit: {remedies}"
            )
        takes = f"{regime.window_s:.2g} s" if isfinite(regime.window_s) else "more than any window"
        source = "" if regime.response_noise_N < 1.5 * job.noise_N else ", mostly of the encoders' steps"
        return (
            f"no contact can be verified: this takes {takes} (longest window: {_BUDGET_S:.2g} s) with a dither"
            f" of {regime.dither_N:.2g} N in a noise of {regime.response_noise_N:.2g} N{source}: {remedies}"
        )

    def _remedies(self) -> Iterator[str]:
        """Yield remedies in this order: different settings, a different sensor, a different gripper."""
        job = self.job

        def of_job(name: str) -> Callable[[float], Verification]:
            return lambda value: replace(self, job=replace(job, **{name: value}))

        if self.press_N:
            pressed = "press with at least {:g} N"
            yield from _remedy(pressed, self.press_N, 1.0, _STEP, lambda value: replace(self, press_N=value))
        else:
            yield from _remedy("raise limits.force_N to {:g}", job.force_N, 1.0, _STEP, of_job("force_N"))
        yield from _remedy("raise limits.speed_mm_s to {:g}", job.speed_m_s, 1e3, _STEP, of_job("speed_m_s"))
        quieter = "use a force sensor with at most {:g} N of noise"
        yield from _remedy(quieter, job.noise_N, 1.0, 1.0 / _STEP, of_job("noise_N"))
        across = of_job("lateral_N_per_m")
        yield from _remedy("use a gripper of at most {:g} N/mm across", job.lateral_N_per_m, 1e-3, 1.0 / _STEP, across)
        stiffness = of_job("axial_N_per_m")
        yield from _remedy("use a gripper of at least {:g} N/mm", job.axial_N_per_m, 1e-3, _STEP, stiffness)
        yield from _remedy("use a gripper of at most {:g} N/mm", job.axial_N_per_m, 1e-3, 1.0 / _STEP, stiffness)


def _remedy(
    text: str, value: float, scale: float, ratio: float, changed: Callable[[float], Verification]
) -> Iterator[str]:
    """Yield the nearest sufficient value, rounded to two digits in the displayed unit."""
    for power in range(1, _STEPS):
        shown = float(f"{value * scale * ratio**power:.2g}")
        if changed(shown / scale).is_possible:
            yield text.format(shown)
            return
