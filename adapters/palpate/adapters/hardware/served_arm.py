"""An arm as its process opens, cycles and stops it: one of our drivers, or a third-party adapter."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from typing_extensions import override

from palpate.adapters.hardware.errors import told, translating
from palpate.core.errors import DeviceError
from palpate.core.ports import AppliedCommand, Clock, CommandLimiter, JointSample, JointVector, Range, Settings
from palpate.drivers.device import ArmDriver
from palpate.drivers.errors import DriverError


@dataclass(frozen=True, slots=True)
class StandBy:
    """What the loop's process has of an arm whose controller goes on without commands.

    Attributes:
        hold: Holds the arm, given where it was seen last, (n,) rad; called when the process that owns it is gone.
        close: Releases what this needs.
    """

    hold: Callable[[JointVector], object]
    close: Callable[[], object]


class ServedArm(ABC):
    """One thread uses it, one call at a time. Making it opens nothing.

    Attributes:
        limiter: What commands are held to before the arm's process gets them.
        divider: Control ticks per cycle.
        max_age_ns: Age above which a sample of the joints is stale; 0 where the arm says so itself.
        answers: Whether what a cycle makes of a set-point is known at once, and only there.
        listens_unpowered: Whether it gives angles without power.
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
        """Whether a fault of its own waits to be acknowledged."""

    @abstractmethod
    def open(self) -> Sequence[str]:
        """Find the arm; nothing gets power. Gives lines for the person."""

    @abstractmethod
    def enable(self) -> None:
        """Let the servos hold it where it stands."""

    @abstractmethod
    def cycle(self, setpoint_rad: JointVector | None) -> tuple[JointSample, AppliedCommand | None]:
        """Exchange a set-point, None to hold, for joint angles; gives what became of it where it ``answers``."""

    @abstractmethod
    def stop(self) -> None:
        """Bring it to rest; at any time."""

    @abstractmethod
    def disable(self) -> None:
        """End what ``enable`` began."""

    @abstractmethod
    def acknowledge(self) -> None:
        """Clear its own fault; a person's decision."""

    @abstractmethod
    def close(self) -> None:
        """Stop it and release its wire."""

    def listen(self) -> bool:
        """Begin to read angles, without power where that can be; True if ``disable`` has to end it."""
        return False

    def stand_by(self) -> StandBy | None:
        """Prepare, in the loop's process, to hold the arm when the other one is gone; None where nothing need."""
        return None

    def diagnostics(self) -> Mapping[str, str]:
        """Return what the arm reports of itself; empty while it is not open."""
        return {}


@dataclass(frozen=True, slots=True)
class OpenArm:
    """A driver on a bus that is open.

    Attributes:
        close: Closes the port or the bus; called after the driver's own ``close``.
    """

    driver: ArmDriver
    close: Callable[[], None]


@dataclass(frozen=True)
class ArmTable(Settings):
    """What the table ``[arm]`` of each of our drivers' arms has."""

    TABLE: ClassVar[str] = "arm"

    divider: Annotated[int, Range(1, 14)] = 1
    """Control ticks per bus cycle."""
    max_age_ms: Annotated[float, Range(1.0, 10_000.0)] = 50.0
    """Age above which a sample of the joints is marked as stale."""
    patience: Annotated[float, Range(0.1, 100.0)] = 1.0
    """Factor on every time-out of the arm and of this computer: 3 for a machine that cannot keep time."""


class DriverArm(ServedArm):
    """An arm that one of our drivers moves, at a whole fraction of the control rate.

    Args:
        judge: Called when the arm is open, before it gets power; returns lines for the person, or refuses the arm.
    """

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
        """The driver, while it is open."""
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
            raise DeviceError(self.name, told(error, self.name)) from error
        sample = self._sample
        if sample is None or found.time_ns > sample.source_time_ns:
            # What was measured before is no news; it grows old.
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
