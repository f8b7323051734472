"""Clauses that hold for every device port: its life, its faults, its end."""

import threading
from abc import abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from itertools import product
from time import perf_counter_ns
from typing import Any, ClassVar, Final

from palpate.core.errors import DeviceError, FaultLatchedError, LifecycleError
from palpate.core.ports.contracts.lives import Lives, Port, RigT, pass_time
from palpate.core.ports.contracts.motion import MotionLimits
from palpate.core.ports.contracts.rigs import DeviceRig
from palpate.core.ports.contracts.violations import (
    knob,
    require,
    require_quiet,
    require_raises,
    says_something,
)
from palpate.core.ports.devices import Device
from palpate.core.ports.lifecycle import Life, LifeRequest

LONG_TICKS: Final = 300
"""What wears off has worn off by then, and an 8-bit counter is full."""

_TRIALS: Final = 8
_FAULTS: Final = 4
_AT_ONCE: Final = 2
"""This fault comes as soon as the device is active."""
_CALLS: Final = 9
_HANG_NS: Final = 500_000_000
"""So long no computer is late."""
_THREAD_S: Final = 1.0
"""How long a thread may take to end after ``close``."""


class DeviceContract(Port[RigT]):
    """Clauses on the life of a device; the port's own suite adds the rest."""

    PORT: ClassVar[type]
    motion: MotionLimits | None = None
    """How far and how fast an arm may be moved, whatever its rig says; None leaves that to the rig."""

    @abstractmethod
    def make(self) -> RigT:
        """A fresh rig, with an adapter that was only constructed."""

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

    def test_constructor_opens_nothing(self) -> None:
        """The constructor opens nothing; ``configure`` does."""
        with self._rig(Life.CONSTRUCTED) as rig:
            is_open = knob(rig.is_open, "is_open")
            require("construction", not is_open(), "an open resource", "a constructor that opens nothing")
            rig.device.configure()
            require("configuration", is_open(), "nothing open", "configure() to open the device")

    def test_life_goes_by_the_table(self) -> None:
        """In trial after trial each request leads where it should; any other is refused and changes nothing."""
        for trials in (0, _TRIALS):
            with self._rig(Life.CONSTRUCTED) as rig:
                lives = Lives(self, rig, (Life.CONSTRUCTED, Life.CONFIGURED, Life.ACTIVE, Life.CLOSED))
                lives.look()
                if trials:
                    lives.upset()
                    lives.ask(LifeRequest.CONFIGURE)
                for trial in range(trials):
                    lives.now_and_then_upset()
                    lives.ask(LifeRequest.ACTIVATE)
                    lives.work()
                    lives.now_and_then_upset()
                    lives.work()
                    if trial < trials - 1:
                        lives.interrupt(LifeRequest.DEACTIVATE)
                        rig.advance(1 if trial else rig.rest_ticks)
                for _ in range(2):
                    lives.ask(LifeRequest.CLOSE)

    def test_fault_latches(self) -> None:
        """A fault stays, cause and all, until acknowledged; that does not activate, and then all is as before."""
        with self._rig(Life.CONSTRUCTED) as rig:
            knob(rig.provoke_fault, "provoke_fault")
            lives = Lives(self, rig, (Life.CONFIGURED, Life.FAULTED, Life.CLOSED))
            lives.look()
            lives.ask(LifeRequest.CONFIGURE)
            for fault in range(_FAULTS):
                lives.ask(LifeRequest.ACTIVATE, look=fault != _AT_ONCE)
                if fault != _AT_ONCE:
                    lives.work()
                if fault % 2:
                    lives.upset()
                    lives.work()
                lives.fail()
                lives.upset()
                rig.advance(rig.rest_ticks if fault == 0 else 1)
                lives.look()
                if fault == 0:
                    lives.fail_again()
                if fault < _FAULTS - 1:
                    lives.ask(LifeRequest.ACKNOWLEDGE)
                    if fault % 2:
                        lives.upset()
                        lives.fail_at_rest()
            for _ in range(2):
                lives.ask(LifeRequest.CLOSE)

    def test_lost_device_raises(self) -> None:
        """When the connection is cut, each use raises DeviceError, by name and cause, until the cable is mended."""
        with self._rig(Life.ACTIVE) as rig:
            cut = knob(rig.disconnect, "disconnect")
            clause = "lost device"
            whose = require_raises(clause, LifecycleError, rig.device.configure, "LifecycleError")
            if self.may_use(rig):
                self.works(rig)
            cut()
            pass_time(rig, rig.patience_ns)
            for _ in range(_CALLS):
                error = require_raises(clause, DeviceError, partial(self.use, rig), "DeviceError each time")
                device, _, what = str(error).partition(": ")
                named = says_something(device) or device == str(whose).partition(": ")[0]
                wanted = "the name of the device, and what happened"
                require(clause, named and says_something(what), f"{str(error)!r}", wanted)
                rig.advance(1)
                self.rests(rig)
            with suppress(DeviceError):
                # Its fault may be acknowledged: then activating, or using it, has to tell again.
                if rig.device.life is Life.FAULTED:
                    rig.device.acknowledge_fault()
                elif rig.device.life is Life.ACTIVE:
                    rig.device.deactivate()
                rig.device.activate()
                pass_time(rig, rig.patience_ns)
                self.use(rig)
                require(clause, False, "no error once it was activated again", "DeviceError while the cable is cut")

    def test_plugged_in_again_all_is_as_before(self) -> None:
        """A cable cut at any time and plugged in again may leave a fault; nothing moves, is old or forgotten."""
        with self._rig(Life.CONSTRUCTED) as rig:
            knob(rig.disconnect, "disconnect"), knob(rig.reconnect, "reconnect")
            lives = Lives(self, rig, (Life.CONFIGURED, Life.FAULTED, Life.CLOSED))
            lives.look()
            lives.ask(LifeRequest.CONFIGURE)
            for how in lives.shuffled(product(("", "stop", "fault", "deactivate"), (False, True), (False, True))):
                lives.recover()
                lives.replug(*how)
            lives.recover()
            lives.ask(LifeRequest.CLOSE)

    def test_close_works_once_the_cable_is_cut(self) -> None:
        """When the connection is cut, ``close`` does not raise and releases everything all the same."""
        with self._rig(Life.ACTIVE) as rig:
            knob(rig.disconnect, "disconnect")()
            clause = "close without a cable"
            require_quiet(clause, rig.device.close, "close() to work when nobody answers")
            _require_life(clause, rig.device, Life.CLOSED, "close()")
            require(clause, rig.is_open is None or not rig.is_open(), "a resource still open", "nothing open")

    def test_failed_configure_leaves_nothing_open(self) -> None:
        """With the connection cut, ``configure`` raises DeviceError and opens nothing, and no thread goes on."""
        with self._rig(Life.CONSTRUCTED) as rig:
            is_open, before = knob(rig.is_open, "is_open"), set(threading.enumerate())
            knob(rig.disconnect, "disconnect")()
            clause = "failed configuration"
            require_raises(clause, DeviceError, rig.device.configure, "DeviceError")
            _require_life(clause, rig.device, Life.CONSTRUCTED, "a failed configure()")
            require(clause, not is_open(), "a resource still open", "nothing open")
            _require_no_thread(clause, before)

    def test_close_releases(self) -> None:
        """After ``close``, whatever came before it, nothing is open, even if ``configure`` was asked for again."""
        for life in (Life.CONFIGURED, Life.ACTIVE, Life.FAULTED):
            with self._rig(Life.CONSTRUCTED) as rig:
                is_open = knob(rig.is_open, "is_open")
                if life is not Life.FAULTED or rig.provoke_fault is not None:
                    bring(rig, life)
                if life is Life.ACTIVE:
                    self.upset(rig)
                with suppress(LifecycleError, FaultLatchedError):
                    rig.device.configure()
                rig.device.close()
                with suppress(LifecycleError):
                    rig.device.configure()
                require("release", not is_open(), "a resource still open", "close() to release everything")

    def test_close_leaves_no_thread(self) -> None:
        """After ``close``, and ``close`` after a fault, no thread is left that the adapter started."""
        for life in (Life.ACTIVE, Life.FAULTED):
            with self._rig(Life.CONSTRUCTED) as rig:
                before = set(threading.enumerate())
                if life is Life.ACTIVE or rig.provoke_fault is not None:
                    bring(rig, life)
                rig.device.close()
                rig.advance(1)
                _require_no_thread("threads", before)

    def test_calls_do_not_block(self) -> None:
        """Reading or sending keeps to the rig's budget for a call, with and without news, and never hangs."""
        with self._rig(Life.ACTIVE) as rig:
            self._check_quick("time of a call", rig)

    def _check_quick(self, clause: str, rig: RigT) -> None:
        def took_ns() -> int:
            # An adapter can sleep through virtual time, and through real time while virtual time stands still.
            start_ns, wall_ns = rig.clock.now_ns(), perf_counter_ns()
            with suppress(DeviceError):
                self.use(rig)
            return max(rig.clock.now_ns() - start_ns, perf_counter_ns() - wall_ns)

        ticks = []
        for _ in range(_CALLS):
            rig.advance(1)
            ticks.append((took_ns(), took_ns()))
        for times_ns in zip(*ticks, strict=True):
            # The one in the middle: a busy computer makes some of them late.
            found_ns, budget_ns = sorted(times_ns)[_CALLS // 2], rig.call_budget_ns
            require(clause, found_ns <= budget_ns, f"{found_ns} ns", f"at most {budget_ns} ns (call_budget_ns)")
            require(clause, max(times_ns) <= _HANG_NS, f"{max(times_ns)} ns", f"never more than {_HANG_NS} ns")


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


def _require_no_thread(clause: str, before: set[threading.Thread]) -> None:
    for thread in set(threading.enumerate()) - before:
        thread.join(_THREAD_S)
        require(clause, not thread.is_alive(), f"{thread.name} still runs", "no thread that goes on")


def _require_life(clause: str, device: Device, life: Life, after: str) -> None:
    require(clause, device.life is life, f"{device.life} after {after}", str(life))


def _members(port: type) -> list[str]:
    return [name for base in port.__mro__[:2] for name in vars(base) if not name.startswith("_")]
