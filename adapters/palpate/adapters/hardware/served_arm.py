"""An arm that runs in the arm process: one of palpate's drivers, or a third-party adapter."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from typing_extensions import override

from palpate.adapters.hardware.errors import message_of, translating
from palpate.core.errors import DeviceError
from palpate.core.ports import AppliedCommand, Clock, CommandLimiter, JointSample, JointVector, Range, Settings
from palpate.drivers.device import ArmDriver
from palpate.drivers.errors import DriverError


@dataclass(frozen=True, slots=True)
class StandBy:
    """The loop process's interface to an arm whose controller keeps running without commands.

    Attributes:
        hold: Function that holds the arm at its last known pose, (n,) rad, after the arm process has ended.
        close: Function that releases the resources of this interface.
    """

    hold: Callable[[JointVector], object]
    close: Callable[[], object]


class ServedArm(ABC):
    """An arm for use by one thread. Its constructor opens nothing.

    Attributes:
        limiter: Limiter that commands pass through before they reach the arm process.
        max_age_ns: Age above which a joint sample is stale, or 0 if the arm marks stale samples itself.
        answers: True if the command applied for a set-point is known only after its cycle.
        listens_unpowered: True if the arm reports angles without power.
    """

    name: str
    limiter: CommandLimiter
    divider: int = 1
    max_age_ns: int = 0
    answers: bool = False
    listens_unpowered: bool = True

    @property
    @abstractmethod
    def is_faulted(self) -> bool:
        """True if an arm fault must be acknowledged."""

    @abstractmethod
    def open(self) -> Sequence[str]:
        """Connect to the arm without switching its power on, and return lines for the operator."""

    @abstractmethod
    def enable(self) -> None:
        """Engage the servos to hold the arm in its current pose."""

    @abstractmethod
    def cycle(self, setpoint_rad: JointVector | None) -> tuple[JointSample, AppliedCommand | None]:
        """Send a set-point, or None to hold. Return joint angles, and the applied command if the arm ``answers``."""

    @abstractmethod
    def stop(self) -> None:
        """Bring the arm to rest. May be called at any time."""

    @abstractmethod
    def disable(self) -> None:
        """Undo ``enable``."""

    @abstractmethod
    def acknowledge(self) -> None:
        """Clear a fault in the arm itself. Only a person may decide to do this."""

    @abstractmethod
    def close(self) -> None:
        """Stop the arm and close its connection."""

    def listen(self) -> bool:
        """Start reading angles, without power if possible. Return True if ``disable`` must be called to end this."""
        return False

    def run_out(self) -> float | None:
        """Move slowly, then stop sending. Return the time in s until the arm stopped, or None if it did not."""
        return None

    def stand_by(self) -> StandBy | None:
        """Return an interface for holding the arm after the arm process has ended, or None if it is not needed."""
        return None

    def diagnostics(self) -> Mapping[str, str]:
        """Return the arm's diagnostics, or an empty mapping while it is not open."""
        return {}


@dataclass(frozen=True, slots=True)
class OpenArm:
    """A driver on an open bus, and a function that closes the bus once the driver is closed."""

    driver: ArmDriver
    close: Callable[[], None]


@dataclass(frozen=True)
class ArmTable(Settings):
    """Settings that the ``[arm]`` tables of all palpate drivers share."""

    TABLE: ClassVar[str] = "arm"

    divider: Annotated[int, Range(1, 14)] = 1
    """Control ticks per bus cycle."""
    max_age_ms: Annotated[float, Range(1.0, 10_000.0)] = 50.0
    """Age above which a joint sample is marked as stale."""
    timeout_scale: Annotated[float, Range(0.1, 100.0)] = 1.0
    """Factor applied to the arm's and this computer's time-outs, such as 3 for a slow computer."""


class DriverArm(ServedArm):
    """An arm with a palpate driver, run at a fraction of the control rate. ``judge`` may reject it before power-up."""

    def __init__(
        self,
        name: str,
        open_bus: Callable[[], OpenArm],
        clock: Clock,
        limiter: CommandLimiter,
        table: ArmTable,
        judge: Callable[[ArmDriver], Sequence[str]] = lambda driver: (),
    ) -> None:
        self.name, self.limiter = name, limiter
        self.divider, self.max_age_ns = table.divider, round(table.max_age_ms * 1e6)
        self._open_bus, self._clock, self._judge = open_bus, clock, judge
        self._opened: OpenArm | None = None
        self._sample: JointSample | None = None

    @property
    def driver(self) -> ArmDriver:
        """The open driver."""
        if self._opened is None:
            raise DeviceError(self.name, "is not open")
        return self._opened.driver

    @property
    @override
    def is_faulted(self) -> bool:
        return self.driver.is_faulted

    @override
    def open(self) -> Sequence[str]:
        try:
            with translating(self.name):
                self._opened = self._open_bus()
                self.driver.open()
            return [f"{self.name}: {note}" for note in (*self.driver.notes, *self._judge(self.driver))]
        except BaseException:
            self.close()
            raise

    @override
    def enable(self) -> None:
        with translating(self.name):
            self.driver.enable()

    @override
    def cycle(self, setpoint_rad: JointVector | None) -> tuple[JointSample, AppliedCommand | None]:
        driver = self.driver
        try:
            found = driver.cycle(setpoint_rad)
        except DriverError as error:
            raise DeviceError(self.name, message_of(error, self.name)) from error
        sample = self._sample
        if sample is None or found.time_ns > sample.source_time_ns:
            # Earlier measurements are not new; their age increases.
            count = 1 if sample is None else sample.sequence + 1
            sample = self._sample = JointSample(found.position_rad, found.time_ns, self._clock.now_ns(), count)
        return sample, None

    @override
    def stop(self) -> None:
        if self._opened is not None:
            self._opened.driver.stop()

    @override
    def disable(self) -> None:
        with translating(self.name):
            self.driver.disable()

    @override
    def acknowledge(self) -> None:
        with translating(self.name):
            self.driver.acknowledge()

    @override
    def close(self) -> None:
        opened, self._opened = self._opened, None
        if opened is not None:
            opened.driver.close()
            opened.close()

    @override
    def diagnostics(self) -> dict[str, str]:
        return {} if self._opened is None else self._opened.driver.diagnostics()
