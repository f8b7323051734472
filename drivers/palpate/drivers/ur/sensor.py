"""Polled force sensor in the tool flange of an e-Series arm."""

from typing import Final

from typing_extensions import override

from palpate.drivers.device import ForceSample, PolledSensor
from palpate.drivers.errors import DriverError, WiringError
from palpate.drivers.ur.link import CHECK, UrLink

RANGE_N: Final = (50.0, 50.0, 50.0)
RANGE_NM: Final = (10.0, 10.0, 10.0)
"""UR5e technical specification, "Force sensing, tool flange", quoted from memory; check the value for your arm."""


class UrToolForce(PolledSensor):
    """The force sensor, in the flange frame, on an open link. It saturates at its rated range."""

    def __init__(self, link: UrLink) -> None:
        super().__init__(f"tool force of {link.host}", CHECK)
        self._link, self._timestamp_s, self._count = link, -1.0, 0

    @override
    def poll(self, now_ns: int) -> list[ForceSample]:
        self._polled_ns = now_ns
        try:
            state = self._link.state()
        except DriverError as error:
            # The driver does not restore a lost connection automatically.
            self.failure = self.failure or WiringError(error.device, error.problem, error.remedy)
            return []
        if state is None or state.timestamp_s == self._timestamp_s:
            return []
        self._timestamp_s, self._count = state.timestamp_s, self._count + 1
        x, y, z, tx, ty, tz = state.wrench
        beyond = any(abs(value) > most for value, most in zip(state.wrench, (*RANGE_N, *RANGE_NM), strict=True))
        found_ns = now_ns - max(0, self._link.stamp_ns() - state.stamp_ns)
        self.latest = ForceSample((x, y, z), (tx, ty, tz), self._count, found_ns, saturated=beyond)
        return [self.latest]
