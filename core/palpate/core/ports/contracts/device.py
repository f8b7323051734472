"""Clauses that hold for every device port: its life, its faults, its end."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from time import perf_counter_ns
from typing import Any, ClassVar, Final, Generic, TypeVar

from palpate.core.errors import DeviceError, FaultLatchedError, LifecycleError
from palpate.core.ports.contracts.motion import MotionLimits
from palpate.core.ports.contracts.rigs import DeviceRig
from palpate.core.ports.contracts.violations import (
    ContractViolation,
    knob,
    require,
    require_quiet,
    require_raises,
)
from palpate.core.ports.devices import Device
from palpate.core.ports.lifecycle import TRANSITIONS, Life, LifeRequest

LONG_TICKS: Final = 300
"""What wears off has worn off by then, and an 8-bit counter is full."""

_CALLS: Final = 9
_HANG_NS: Final = 500_000_000
"""So long no computer is late."""
_THREAD_S: Final = 1.0
"""How long a thread may take to end after ``close``."""

RigT = TypeVar("RigT", bound=DeviceRig[Any])


class DeviceContract(ABC, Generic[RigT]):
    """Clauses on the life of a device; the port's own suite adds the rest."""

    PORT: ClassVar[type]
    motion: MotionLimits | None = None
    """How far and how fast an arm may be moved, whatever its rig says; None leaves that to the rig."""

    @abstractmethod
    def make(self) -> RigT:
        """A fresh rig, with an adapter that was only constructed."""

    @abstractmethod
    def _use(self, rig: RigT) -> object:
        """What the port is there for: one reading, or one command to stay."""

    @contextmanager
    def _rig(self, life: Life) -> Iterator[RigT]:
        """A fresh rig whose adapter was brought to this state; released afterwards."""
        rig = self.make()
        if self.motion is not None:
            rig = rig.within(self.motion)
        try:
            bring(rig, life)
            yield rig
        finally:
            for device in rig.all_devices:
                # Closing has clauses of its own; a failure here must not hide what this one found.
                with suppress(Exception):
                    if device.life is not Life.CLOSED:
                        device.close()
            rig.dispose()

    def test_matches_the_port(self) -> None:
        """The adapter has every method of its port."""
        with self._rig(Life.CONSTRUCTED) as rig:
            missing = [name for name in _members(self.PORT) if not hasattr(rig.device, name)]
            require("port", not missing, f"no {', '.join(missing)}", f"all methods of {self.PORT.__name__}")

    def test_starts_constructed(self) -> None:
        """A new adapter is in the state CONSTRUCTED, without a fault."""
        with self._rig(Life.CONSTRUCTED) as rig:
            _require_life("start", rig.device, Life.CONSTRUCTED, "construction")
            require("start", rig.device.fault is None, f"fault {rig.device.fault!r}", "no fault")

    def test_constructor_opens_nothing(self) -> None:
        """The constructor opens nothing; ``configure`` does."""
        with self._rig(Life.CONSTRUCTED) as rig:
            is_open = knob(rig.is_open, "is_open")
            require("construction", not is_open(), "an open resource", "a constructor that opens nothing")
            rig.device.configure()
            require("configuration", is_open(), "nothing open", "configure() to open the device")

    def test_whole_life(self) -> None:
        """Configure, activate, deactivate, activate again, deactivate, close: each leads where it should."""
        with self._rig(Life.CONSTRUCTED) as rig:
            device = rig.device
            device.configure()
            _require_life("life cycle", device, Life.CONFIGURED, "configure()")
            for _ in range(2):
                device.activate()
                _require_life("life cycle", device, Life.ACTIVE, "activate()")
                rig.advance(1)
                device.deactivate()
                _require_life("life cycle", device, Life.CONFIGURED, "deactivate()")
            device.close()
            _require_life("life cycle", device, Life.CLOSED, "close()")

    def test_illegal_requests_raise(self) -> None:
        """Each request that the state does not allow raises LifecycleError and changes nothing."""
        for life in (Life.CONSTRUCTED, Life.CONFIGURED, Life.ACTIVE, Life.CLOSED):
            self._check_illegal_requests(life, LifecycleError)

    def test_illegal_requests_raise_while_faulted(self) -> None:
        """While a fault is latched, every request but acknowledging and closing raises."""
        self._check_illegal_requests(Life.FAULTED, (LifecycleError, FaultLatchedError))

    def test_use_outside_active_raises(self) -> None:
        """Reading or sending before ``activate``, after ``deactivate`` or after ``close`` raises LifecycleError."""
        for life in (Life.CONSTRUCTED, Life.CONFIGURED, Life.CLOSED):
            with self._rig(life) as rig:
                wanted = f"LifecycleError while {life.value}"
                require_raises("use outside active", LifecycleError, partial(self._use, rig), wanted)
        with self._rig(Life.ACTIVE) as rig:
            rig.device.deactivate()
            require_raises("deactivated", LifecycleError, lambda: self._use(rig), "LifecycleError")

    def test_close_works_from_every_state(self) -> None:
        """``close`` works in every state, twice too, and leads to CLOSED."""
        for life in (Life.CONSTRUCTED, Life.CONFIGURED, Life.ACTIVE):
            self._check_close(life)

    def test_close_works_while_faulted(self) -> None:
        """``close`` works while a fault is latched."""
        self._check_close(Life.FAULTED)

    def test_fault_latches(self) -> None:
        """A fault stays: the state is FAULTED, the cause is kept, every use raises FaultLatchedError."""
        with self._rig(Life.FAULTED) as rig:
            _require_life("fault", rig.device, Life.FAULTED, "a fault")
            require("fault", bool(rig.device.fault), f"fault {rig.device.fault!r}", "the cause of the fault")
            for ticks in (1, 1, LONG_TICKS, 1):
                require_raises("fault", FaultLatchedError, lambda: self._use(rig), "FaultLatchedError each time")
                rig.advance(ticks)

    def test_activate_does_not_clear_a_fault(self) -> None:
        """``activate`` raises FaultLatchedError while a fault is latched, however often, and the fault stays."""
        with self._rig(Life.FAULTED) as rig:
            clause = "activate while faulted"
            for _ in range(3):
                require_raises(clause, FaultLatchedError, rig.device.activate, "FaultLatchedError each time")
                _require_life(clause, rig.device, Life.FAULTED, "activate()")
            require(clause, bool(rig.device.fault), "no fault any more", "the fault to stay")

    def test_acknowledging_does_not_activate(self) -> None:
        """``acknowledge_fault`` leads to CONFIGURED, never to ACTIVE; ``activate`` works again after it."""
        with self._rig(Life.FAULTED) as rig:
            clause, device = "acknowledged fault", rig.device
            device.acknowledge_fault()
            _require_life(clause, device, Life.CONFIGURED, "acknowledge_fault()")
            require(clause, device.fault is None, f"fault {device.fault!r}", "no fault")
            require_raises(clause, LifecycleError, lambda: self._use(rig), "LifecycleError until activated")
            device.activate()
            _require_life(clause, device, Life.ACTIVE, "activate()")

    def test_lost_device_raises(self) -> None:
        """When the connection is cut, reading or sending raises DeviceError."""
        with self._rig(Life.ACTIVE) as rig:
            knob(rig.disconnect, "disconnect")()
            pass_time(rig, rig.patience_ns)
            require_raises("lost device", DeviceError, lambda: self._use(rig), "DeviceError")

    def test_close_works_once_the_cable_is_cut(self) -> None:
        """When the connection is cut, ``close`` does not raise and releases everything all the same."""
        with self._rig(Life.ACTIVE) as rig:
            knob(rig.disconnect, "disconnect")()
            clause = "close without a cable"
            require_quiet(clause, rig.device.close, "close() to work when nobody answers")
            _require_life(clause, rig.device, Life.CLOSED, "close()")
            require(clause, rig.is_open is None or not rig.is_open(), "a resource still open", "nothing open")

    def test_failed_configure_leaves_nothing_open(self) -> None:
        """With the connection cut, ``configure`` raises DeviceError and opens nothing."""
        with self._rig(Life.CONSTRUCTED) as rig:
            is_open = knob(rig.is_open, "is_open")
            knob(rig.disconnect, "disconnect")()
            clause = "failed configuration"
            require_raises(clause, DeviceError, rig.device.configure, "DeviceError")
            _require_life(clause, rig.device, Life.CONSTRUCTED, "a failed configure()")
            require(clause, not is_open(), "a resource still open", "nothing open")

    def test_close_releases(self) -> None:
        """After ``close`` nothing is open any more, even if ``configure`` was asked for twice, or once more."""
        with self._rig(Life.CONFIGURED) as rig:
            is_open = knob(rig.is_open, "is_open")
            with suppress(LifecycleError):
                rig.device.configure()
            rig.device.close()
            with suppress(LifecycleError):
                rig.device.configure()
            require("release", not is_open(), "a resource still open", "close() to release everything")

    def test_close_leaves_no_thread(self) -> None:
        """After ``close`` no thread is left that the adapter started."""
        with self._rig(Life.CONSTRUCTED) as rig:
            before = set(threading.enumerate())
            bring(rig, Life.ACTIVE)
            rig.device.close()
            rig.advance(1)
            for thread in set(threading.enumerate()) - before:
                thread.join(_THREAD_S)
                require("threads", not thread.is_alive(), f"{thread.name} still runs", "no thread after close()")

    def test_calls_do_not_block(self) -> None:
        """Reading or sending keeps to the rig's budget for a call, with and without news, and never hangs."""
        with self._rig(Life.ACTIVE) as rig:
            self._check_quick("time of a call", rig)

    def _check_quick(self, clause: str, rig: RigT) -> None:
        def use() -> None:
            with suppress(DeviceError):
                self._use(rig)

        ticks = []
        for _ in range(_CALLS):
            rig.advance(1)
            ticks.append((took_ns(rig, use), took_ns(rig, use)))
        for times_ns in zip(*ticks, strict=True):
            # The one in the middle: a busy computer makes some of them late.
            found_ns, budget_ns = sorted(times_ns)[_CALLS // 2], rig.call_budget_ns
            require(clause, found_ns <= budget_ns, f"{found_ns} ns", f"at most {budget_ns} ns (call_budget_ns)")
            require(clause, max(times_ns) <= _HANG_NS, f"{max(times_ns)} ns", f"never more than {_HANG_NS} ns")

    def _check_illegal_requests(self, life: Life, errors: type[Exception] | tuple[type[Exception], ...]) -> None:
        with self._rig(life) as rig:
            for request in LifeRequest:
                # What is missing has a clause of its own.
                action = getattr(rig.device, request.value, None)
                if action is not None and (life, request) not in TRANSITIONS:
                    wanted = f"an error on {request.value}() while {life.value}"
                    require_raises("illegal request", errors, action, wanted)
                    _require_life("illegal request", rig.device, life, f"a refused {request.value}()")

    def _check_close(self, life: Life) -> None:
        with self._rig(life) as rig:
            for _ in range(2):
                require_quiet("close", rig.device.close, f"close() to work while {life.value}, twice too")
                _require_life("close", rig.device, Life.CLOSED, f"close() while {life.value}")


def bring(rig: DeviceRig[Any], life: Life) -> None:
    """Bring a freshly made rig's adapter to a state; an active one has had time for a first sample."""
    provoke = knob(rig.provoke_fault, "provoke_fault") if life is Life.FAULTED else None
    if life is not Life.CONSTRUCTED:
        rig.device.configure()
    if life in (Life.ACTIVE, Life.FAULTED):
        rig.device.activate()
        rig.advance(1)
    if provoke is not None:
        provoke()
    if life is Life.CLOSED:
        rig.device.close()


def activate(device: Device) -> None:
    """Make a companion device active, whatever has been done to it before."""
    if device.life is Life.CONSTRUCTED:
        device.configure()
    if device.life is Life.CONFIGURED:
        device.activate()


def pass_time(rig: DeviceRig[Any], duration_ns: int) -> None:
    """Let more than ``duration_ns`` go by, one tick at a time.

    Raises:
        ContractViolation: The rig's clock stands still, so that nothing could be shown.
    """
    start_ns = rig.clock.now_ns()
    while (before_ns := rig.clock.now_ns()) <= start_ns + duration_ns:
        rig.advance(1)
        if rig.clock.now_ns() <= before_ns:
            raise ContractViolation("rig", "a clock that stands still", "advance() to let time go on")


def took_ns(rig: DeviceRig[Any], action: Callable[[], object]) -> int:
    """How long something takes, by the rig's clock or by the wall, whichever says more."""
    # An adapter can sleep through virtual time, and through real time while virtual time stands still.
    start_ns, wall_ns = rig.clock.now_ns(), perf_counter_ns()
    action()
    return max(rig.clock.now_ns() - start_ns, perf_counter_ns() - wall_ns)


def _require_life(clause: str, device: Device, life: Life, after: str) -> None:
    require(clause, device.life is life, f"{device.life} after {after}", str(life))


def _members(port: type) -> list[str]:
    return [name for base in port.__mro__[:2] for name in vars(base) if not name.startswith("_")]
