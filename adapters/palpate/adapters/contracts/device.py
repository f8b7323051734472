"""Clauses for every device port: life cycle, faults and closing."""

import threading
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from time import perf_counter_ns
from typing import Any, Final, Generic, TypeVar

from palpate.adapters.contracts.bench import DeviceRig, parameter, require, require_raises
from palpate.adapters.contracts.life import try_lives
from palpate.core.errors import DeviceError, LifecycleError
from palpate.core.ports import Life

RigT = TypeVar("RigT", bound=DeviceRig[Any])

LONG_TICKS: Final = 300
"""Number of stationary ticks after which transient effects have ended."""

_CALLS: Final = 9
_HANG_NS: Final = 500_000_000
_THREAD_S: Final = 1.0
"""Time limit for a thread to end after ``close``."""


class DeviceContract(ABC, Generic[RigT]):
    """Clauses for a device's life cycle; each port's suite adds further clauses."""

    may_command: bool = True
    """True if commands, including commands that are too fast, may be sent to the arm; False for a real arm."""

    @abstractmethod
    def make(self) -> RigT:
        """Return a new rig with an adapter that is constructed but not configured."""

    def may_use(self) -> bool:
        """Return True if the device may be used at all."""
        return True

    @abstractmethod
    def use(self, rig: RigT) -> object:
        """Take one reading, or send one command that holds the position."""

    @abstractmethod
    def work(self, rig: RigT) -> None:
        """Fail the clause unless the active device works."""

    def start_work(self, rig: RigT) -> None:
        """Start an activity on the active device for the next request to interrupt."""

    def disturb(self, rig: RigT) -> None:
        """Cause events that are possible in any state."""

    def rest(self, rig: RigT) -> None:
        """Fail the clause if something has moved without a command."""

    def activated(self, rig: RigT) -> None:
        """Record that the device has just been activated."""

    @contextmanager
    def rig(self, life: Life) -> Iterator[RigT]:
        """Yield a new rig with its adapter in the given state, and release it afterwards."""
        rig = self.make()
        try:
            bring(rig, life)
            yield rig
        finally:
            for device in rig.all_devices:
                # Other clauses test closing; a failure here must not hide this clause's result.
                with suppress(Exception):
                    if device.life is not Life.CLOSED:
                        device.close()
            rig.dispose()

    def test_only_configure_opens(self) -> None:
        """Only ``configure`` opens the device; if it fails, it raises DeviceError and leaves nothing open."""
        clause = "configuration"
        with self.rig(Life.CONSTRUCTED) as rig:
            is_open = parameter(rig.is_open, "is_open")
            require(clause, not is_open(), "an open resource", "a constructor that opens nothing")
            rig.device.configure()
            require(clause, is_open(), "nothing open", "configure() to open the device")
        with self.rig(Life.CONSTRUCTED) as rig:
            if rig.disconnect is not None:
                before = set(threading.enumerate())
                rig.disconnect()
                require_raises(clause, DeviceError, rig.device.configure, "DeviceError with the cable cut")
                require(clause, rig.device.life is Life.CONSTRUCTED, f"{rig.device.life}", "CONSTRUCTED")
                require(clause, not parameter(rig.is_open, "is_open")(), "a resource still open", "nothing open")
                _require_no_thread(clause, before)

    def test_life_follows_the_table(self) -> None:
        """After any requests, work, faults and disconnections, the state is correct and the device works."""
        with self.rig(Life.CONSTRUCTED) as rig:
            live = rig.runs_by_itself or not self.may_command
        # Five life cycles detect every unsafe adapter in the tests.
        try_lives(self, 5 if live else 12)

    def test_lost_device_raises(self) -> None:
        """With no cable connected, each use raises DeviceError, even after reactivation, and ``close`` still works."""
        with self.rig(Life.ACTIVE) as rig:
            clause, device = "lost device", rig.device
            cut = parameter(rig.disconnect, "disconnect")
            self.use(rig)
            cut()
            rig.pass_time(rig.timeout_ns)
            for _ in range(_CALLS):
                require_raises(clause, DeviceError, partial(self.use, rig), "DeviceError each time")
                rig.advance(1)
            with suppress(DeviceError):
                (device.acknowledge_fault if device.life is Life.FAULTED else device.deactivate)()
                device.activate()
                rig.pass_time(rig.timeout_ns)
                self.use(rig)
                require(clause, False, "no error once it was activated again", "DeviceError while the cable is cut")
            device.close()
            require(clause, device.life is Life.CLOSED, f"{device.life}", "CLOSED")
            require(clause, rig.is_open is None or not rig.is_open(), "a resource still open", "nothing open")

    def test_close_releases_everything(self) -> None:
        """After ``close`` in any state, nothing is open and no adapter thread is running."""
        for life in (Life.CONSTRUCTED, Life.CONFIGURED, Life.ACTIVE, Life.FAULTED):
            with self.rig(Life.CONSTRUCTED) as rig:
                before = set(threading.enumerate())
                bring(rig, Life.ACTIVE if life is Life.FAULTED and rig.provoke_fault is None else life)
                if life is Life.ACTIVE:
                    self.disturb(rig)
                rig.device.close()
                with suppress(LifecycleError):
                    rig.device.configure()
                require("release", rig.is_open is None or not rig.is_open(), "a resource still open", "nothing open")
                _require_no_thread("release", before)

    def test_calls_do_not_block(self) -> None:
        """A reading or a command stays within the rig's call budget, with or without a new sample."""
        with self.rig(Life.ACTIVE) as rig:
            self.require_quick("time of a call", rig)

    def require_quick(self, clause: str, rig: RigT) -> None:
        """Fail the clause if the median call duration exceeds the budget, or if a call hangs."""
        times_ns = []
        for call in range(2 * _CALLS):
            rig.advance(call % 2)
            # An adapter can block in virtual time, or in real time while virtual time does not advance.
            start_ns, wall_ns = rig.clock.now_ns(), perf_counter_ns()
            with suppress(DeviceError):
                self.use(rig)
            times_ns.append(max(rig.clock.now_ns() - start_ns, perf_counter_ns() - wall_ns))
        for some_ns in (times_ns[::2], times_ns[1::2]):
            median_ns, budget_ns = sorted(some_ns)[_CALLS // 2], rig.call_budget_ns
            require(clause, median_ns <= budget_ns, f"{median_ns} ns", f"at most {budget_ns} ns (call_budget_ns)")
            require(clause, max(some_ns) <= _HANG_NS, f"{max(some_ns)} ns", f"never more than {_HANG_NS} ns")


def bring(rig: DeviceRig[Any], life: Life) -> None:
    """Bring a new rig's adapter to a state; an active adapter gets one tick to provide its first sample."""
    provoke = parameter(rig.provoke_fault, "provoke_fault") if life is Life.FAULTED else None
    if life is not Life.CONSTRUCTED:
        rig.device.configure()
    if life in (Life.ACTIVE, Life.FAULTED):
        rig.device.activate()
        rig.advance(1)
    if provoke is not None:
        provoke()
    if life is Life.CLOSED:
        rig.device.close()


def _require_no_thread(clause: str, before: set[threading.Thread]) -> None:
    for thread in set(threading.enumerate()) - before:
        thread.join(_THREAD_S)
        require(clause, not thread.is_alive(), f"{thread.name} still runs", "no thread that goes on")
