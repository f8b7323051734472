"""What a cycle costs on a bus, and which rates it leaves."""

from dataclasses import dataclass
from typing import Final

from palpate.drivers.errors import SettingError

_SLOWEST_FRACTION: Final = 140


@dataclass(frozen=True, slots=True)
class BusBudget:
    """What one cycle over all axes costs, and so which rates a bus carries: for serial lines and CAN. CALC throughout.

    Attributes:
        cycle_s: Time that one cycle takes at least.
        share: Share of the period that cycles may take; the rest is for whatever is late, and for other traffic.
    """

    bus: str
    load: str
    cycle_s: float
    share: float

    @property
    def max_rate_Hz(self) -> float:
        """The highest rate that leaves the reserve."""
        return self.share / self.cycle_s

    def fitting_rates_Hz(self, control_rate_Hz: float) -> tuple[float, ...]:
        """The whole fractions of the control rate that fit, the highest first."""
        fractions = (control_rate_Hz / divider for divider in range(1, _SLOWEST_FRACTION + 1))
        return tuple(rate for rate in fractions if rate <= self.max_rate_Hz)

    def require(self, control_rate_Hz: float, divider: int) -> None:
        """Refuse a fraction of the control rate that does not fit.

        Raises:
            SettingError: It does not fit; the message has the numbers and the rates that do.
        """
        if not (control_rate_Hz > 0.0 and divider >= 1):
            problem = f"every {divider}th tick of {control_rate_Hz} Hz is no rate of cycles"
            raise SettingError(self.bus, problem, "give a positive control rate and a divider of 1 or more")
        rate_Hz = control_rate_Hz / divider
        if rate_Hz <= self.max_rate_Hz:
            return
        rates = ", ".join(f"{rate:.4g}" for rate in self.fitting_rates_Hz(control_rate_Hz)[:4]) or "none"
        problem = (
            f"a cycle at {rate_Hz:.4g} Hz does not fit: {self.load},"
            f" so {self.max_rate_Hz:.4g} Hz at most with {1.0 - self.share:.0%} in reserve"
        )
        raise SettingError(self.bus, problem, f"choose a fitting fraction of {control_rate_Hz:.4g} Hz: {rates}")
