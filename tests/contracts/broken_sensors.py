"""Broken force sensors, and the clauses by which the contract notices them.

Their lives stand for those of every device: the clauses are the same.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from palpate.core.ports import Life, WrenchKind, WrenchSample
from palpate.core.ports.contracts import TICK_NS, FakeClock
from tests.fake_devices import FakeForceSensor


class WithoutAcknowledge(FakeForceSensor):
    """Like a stranger's class that forgot a method."""

    def __getattribute__(self, name: str) -> object:
        if name == "acknowledge_fault":
            raise AttributeError(name)
        return super().__getattribute__(name)


class BornFaulty(FakeForceSensor):
    def __init__(self, clock: FakeClock) -> None:
        super().__init__(clock)
        self._fault = "left from last time"


class OpensInConstructor(FakeForceSensor):
    def __init__(self, clock: FakeClock) -> None:
        super().__init__(clock)
        self.is_open = True

    def _on_configure(self) -> None:
        self.is_open = False
        super()._on_configure()


class OpensTooLate(FakeForceSensor):
    def _on_configure(self) -> None: ...


class DeactivatesOnce(FakeForceSensor):
    used = False

    def _on_deactivate(self) -> None:
        if self.used:
            raise RuntimeError("only once")
        self.used = True


class ActivatesTwice(FakeForceSensor):
    def activate(self) -> None:
        if self._life is not Life.ACTIVE:
            super().activate()


class ConfiguresWhileFaulted(FakeForceSensor):
    def configure(self) -> None:
        if self._life is not Life.FAULTED:
            super().configure()


class ReadsWhenClosed(FakeForceSensor):
    def _require_active(self, request: str) -> None:
        if self._life is not Life.CLOSED:
            super()._require_active(request)


class ReadsWhenDeactivated(FakeForceSensor):
    deactivated = False

    def _on_deactivate(self) -> None:
        self.deactivated = True

    def _require_active(self, request: str) -> None:
        if not self.deactivated:
            super()._require_active(request)


class RefusesToClose(FakeForceSensor):
    refused_in = Life.CONSTRUCTED

    def close(self) -> None:
        if self._life is self.refused_in:
            raise RuntimeError("cannot be closed now")
        super().close()


class RefusesToCloseFaulted(RefusesToClose):
    refused_in = Life.FAULTED


class RefusesToCloseTwice(RefusesToClose):
    refused_in = Life.CLOSED


class StaysOpen(FakeForceSensor):
    def _on_close(self) -> None: ...


class FaultClearsItself(FakeForceSensor):
    def read(self) -> WrenchSample:
        try:
            return super().read()
        finally:
            if self._life is Life.FAULTED:
                self._life = Life.ACTIVE


class ActivateClearsFault(FakeForceSensor):
    def activate(self) -> None:
        if self._life is Life.FAULTED:
            self.acknowledge_fault()
        super().activate()


class AcknowledgeActivates(FakeForceSensor):
    def acknowledge_fault(self) -> None:
        super().acknowledge_fault()
        self.activate()


class ActivateForgetsFault(FakeForceSensor):
    def activate(self) -> None:
        try:
            super().activate()
        finally:
            self._fault = None


class HidesDisconnection(FakeForceSensor):
    def _require_connection(self) -> None:
        if self._life is not Life.ACTIVE:
            super()._require_connection()


LIVED = {"test_life_goes_by_the_table", "test_fault_latches"}
LIVES: list[tuple[Any, dict[str, Any], set[str]]] = [
    (WithoutAcknowledge, {"provoke_fault": None}, {"test_matches_the_port"}),
    (BornFaulty, {}, LIVED),
    (OpensInConstructor, {}, {"test_constructor_opens_nothing"}),
    (OpensTooLate, {}, {"test_constructor_opens_nothing", "test_failed_configure_leaves_nothing_open"}),
    (DeactivatesOnce, {"provoke_fault": None}, {"test_life_goes_by_the_table"}),
    (ActivatesTwice, {}, {"test_life_goes_by_the_table"}),
    (ConfiguresWhileFaulted, {}, {"test_fault_latches"}),
    (ReadsWhenClosed, {}, LIVED),
    (ReadsWhenDeactivated, {}, {"test_life_goes_by_the_table"}),
    (RefusesToClose, {}, {"test_life_goes_by_the_table"}),
    (RefusesToCloseFaulted, {}, {"test_fault_latches", "test_close_releases", "test_close_leaves_no_thread"}),
    (RefusesToCloseTwice, {}, {"test_life_goes_by_the_table", "test_fault_latches"}),
    (StaysOpen, {}, {"test_close_releases", "test_close_works_once_the_cable_is_cut"}),
    (FaultClearsItself, {}, {"test_fault_latches"}),
    (
        ActivateClearsFault,
        {},
        {"test_fault_latches"},
    ),
    (ActivateForgetsFault, {}, {"test_fault_latches"}),
    (AcknowledgeActivates, {}, {"test_fault_latches"}),
    (HidesDisconnection, {}, {"test_lost_device_raises"}),
]


def altered(base: Any, /, **changes: Callable[[Any], Any]) -> Any:
    """A kind of device whose samples differ from the true ones in some fields."""

    def read(device: Any) -> Any:
        sample = base.read(device)
        return replace(sample, **{name: change(sample) for name, change in changes.items()})

    return type("Altered", (base,), {"read": read})


class CountsReadings(FakeForceSensor):
    """Passes the same sample off as a new one each time it is read."""

    readings = 0

    def read(self) -> WrenchSample:
        self.readings += 1
        return replace(super().read(), sequence=self.readings)


def never_stale(clock: FakeClock) -> FakeForceSensor:
    return FakeForceSensor(clock, max_age_ns=10**18)


class TaresOnConfigure(FakeForceSensor):
    zero_N = (0.0, 0.0, 0.0)

    def _on_configure(self) -> None:
        super()._on_configure()
        self.zero_N = self.load_N

    def read(self) -> WrenchSample:
        sample = super().read()
        return replace(sample, force_N=tuple(f - zero for f, zero in zip(sample.force_N, self.zero_N, strict=True)))


class TaresOnActivate(TaresOnConfigure):
    def _on_activate(self) -> None:
        self.zero_N = self.load_N


class TaresOnFirstReading(TaresOnConfigure):
    tared = False

    def read(self) -> WrenchSample:
        if not self.tared:
            self.zero_N, self.tared = self.load_N, True
        return super().read()


TARE = {"test_no_hidden_tare"}
SAMPLES: list[tuple[Any, dict[str, Any], set[str]]] = [
    (altered(FakeForceSensor, receive_time_ns=lambda s: float(s.receive_time_ns)), {}, {"test_every_sample_is_sound"}),
    (altered(FakeForceSensor, sequence=lambda s: s.sequence + 0.5), {}, {"test_every_sample_is_sound"}),
    (altered(FakeForceSensor, receive_time_ns=lambda s: s.source_time_ns - 1), {}, {"test_every_sample_is_sound"}),
    (altered(FakeForceSensor, receive_time_ns=lambda s: s.receive_time_ns + 1), {}, {"test_every_sample_is_sound"}),
    (
        altered(FakeForceSensor, source_time_ns=lambda s: s.source_time_ns - 9 * TICK_NS),
        {},
        {"test_every_sample_is_sound", "test_lost_device_raises", "test_what_is_beyond_the_range_is_marked", *LIVED},
    ),
    (altered(FakeForceSensor, sequence=lambda s: s.sequence % 256), {}, {"test_every_sample_is_sound"}),
    (
        altered(FakeForceSensor, sequence=lambda s: s.sequence // 2),
        {},
        {"test_every_sample_is_sound", "test_lost_device_raises", "test_what_is_beyond_the_range_is_marked", *LIVED},
    ),
    (CountsReadings, {}, {"test_reading_twice_gives_the_same_sample", "test_silence_is_not_passed_off_as_news"}),
    (never_stale, {}, {"test_silence_is_not_passed_off_as_news"}),
    (altered(FakeForceSensor, force_N=lambda s: list(s.force_N)), {}, {"test_every_sample_is_sound"}),
    (altered(FakeForceSensor, torque_Nm=lambda _: (0, 0, 0)), {"twist_Nm": None}, {"test_every_sample_is_sound"}),
    (altered(FakeForceSensor, kind=lambda _: WrenchKind.TARED), {}, {"test_every_sample_is_sound"}),
    (altered(FakeForceSensor, frame=lambda _: " "), {}, {"test_every_sample_is_sound"}),
    (
        altered(FakeForceSensor, force_N=lambda s: tuple(-f for f in s.force_N)),
        {},
        {"test_pressing_on_the_tip_gives_negative_fz"},
    ),
    (
        altered(FakeForceSensor, force_N=lambda s: tuple(f / 9.80665 for f in s.force_N)),
        {},
        {"test_load_is_reported_in_newtons_on_its_axis"},
    ),
    (
        altered(FakeForceSensor, force_N=lambda s: (s.force_N[1], s.force_N[0], s.force_N[2])),
        {},
        {"test_load_is_reported_in_newtons_on_its_axis"},
    ),
    (TaresOnConfigure, {}, TARE),
    (TaresOnActivate, {}, TARE | LIVED),
    (TaresOnFirstReading, {}, TARE),
]
