"""Sensors whose silence is never taken for news."""

from collections.abc import Callable
from dataclasses import replace
from typing import ClassVar, Generic

from typing_extensions import override

from palpate.adapters.hardware.watchdogs.trip import TellTrip, WatchdogTrip, tell_surely
from palpate.core.errors import CommandError, ConfigurationError, DeviceError
from palpate.core.ports import (
    Clock,
    DeviceDecorator,
    ForceSensor,
    JointEncoder,
    JointSample,
    SampleT,
    Sensor,
    Validity,
    WrenchSample,
)


class _WatchedSensor(DeviceDecorator, Generic[SampleT]):
    """A sensor that is believed only as long as its sequence number goes on.

    A sample that is no news, over age, or older than one before is marked ``STALE``.

    Args:
        max_age_ns: Longest time without news, and greatest age, of a sample that is passed on as it is.
        dead_after_ns: After that long without news, reading raises DeviceError.
        tell: Is told when samples become stale or make no sense, and when the sensor counts as dead.
        joints: Number of joints; a sample of any other length makes no sense. 0 takes any.
    """

    NAME: ClassVar[str]

    def __init__(
        self,
        sensor: Sensor[SampleT],
        clock: Clock,
        max_age_ns: int,
        *,
        dead_after_ns: int,
        tell: TellTrip | None = None,
        joints: int = 0,
    ) -> None:
        super().__init__(sensor)
        self._joints = joints
        if not 0 < max_age_ns <= dead_after_ns:
            raise ConfigurationError(
                "max_age_ns", max_age_ns, f"more than 0 and at most {dead_after_ns}, the second limit"
            )
        self._clock, self._tell = clock, tell
        self._read: Callable[[], SampleT] = sensor.read
        self._max_age_ns, self._dead_after_ns = max_age_ns, dead_after_ns
        self._begin_anew()

    def _begin_anew(self) -> None:
        self._newest: int | None = None
        self._sound: SampleT | None = None
        self._news_ns = 0
        self._told = ""

    @override
    def activate(self) -> None:
        super().activate()
        self._begin_anew()

    def read(self) -> SampleT:
        """A sample, marked as old as it is; ``INVALID`` where the device gives nothing that makes sense."""
        try:
            sample = self._read()
        except (CommandError, ValueError, TypeError) as error:
            # No sample can be made of numbers that are none, or of too many.
            return self._garbled(f"gives no sample ({error})", error)
        if self._joints and isinstance(sample, JointSample) and len(sample.position_rad) != self._joints:
            return self._garbled(f"gives {len(sample.position_rad)} joint angles, the arm has {self._joints}")
        self._sound = sample
        now_ns, number = self._clock.now_ns(), sample.sequence
        if self._newest is None or number > self._newest:
            self._newest, self._news_ns = number, now_ns
        silence_ns = now_ns - self._news_ns
        if silence_ns > self._dead_after_ns:
            text = f"no new sample for {silence_ns * 1e-6:.1f} ms"
            self._tell_once("dead", now_ns, text)
            raise DeviceError(self.NAME, text)
        if number < self._newest:
            trouble = f"sample {number} came after sample {self._newest}"
        elif silence_ns > self._max_age_ns:
            trouble = f"no new sample for {silence_ns * 1e-6:.1f} ms"
        elif now_ns - sample.source_time_ns > self._max_age_ns:
            trouble = f"a sample that is {(now_ns - sample.source_time_ns) * 1e-6:.1f} ms old"
        else:
            self._told = ""
            return sample
        self._tell_once("stale", now_ns, trouble)
        return sample if sample.validity is Validity.INVALID else replace(sample, validity=Validity.STALE)

    def _garbled(self, text: str, cause: Exception | None = None) -> SampleT:
        """The last sample that made sense, marked invalid, so that the supervisor leads the arm back and latches."""
        if self._sound is None:
            raise DeviceError(self.NAME, text) from cause
        self._news_ns = self._clock.now_ns()
        self._tell_once("invalid", self._news_ns, text)
        return replace(self._sound, validity=Validity.INVALID)

    def _tell_once(self, state: str, now_ns: int, text: str) -> None:
        if self._told != state:
            self._told = state
            tell_surely(self._tell, WatchdogTrip(now_ns, self.NAME, f"{state}: {text}"))


class WatchedForceSensor(_WatchedSensor[WrenchSample], ForceSensor):
    """A force sensor whose silence is never taken for news."""

    NAME = "force sensor"


class WatchedJointEncoder(_WatchedSensor[JointSample], JointEncoder):
    """Joint encoders whose silence is never taken for news."""

    NAME = "joint encoder"
