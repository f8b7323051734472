"""Whole lives of an adapter, held step by step against the table of :mod:`palpate.core.ports.lifecycle`.

The order of what is tried is drawn from a seed, so that it is another at each step and the same at each run.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from contextlib import suppress
from random import Random
from typing import Any, Final, Generic, TypeVar
from unittest import SkipTest

from palpate.core.errors import DeviceError, FaultLatchedError, LifecycleError
from palpate.core.ports.contracts.rigs import DeviceRig
from palpate.core.ports.contracts.violations import (
    ContractViolation,
    knob,
    require,
    require_quiet,
    require_raises,
    says_something,
)
from palpate.core.ports.lifecycle import TRANSITIONS, Life, LifeRequest

T = TypeVar("T")
RigT = TypeVar("RigT", bound=DeviceRig[Any])

_SEED: Final = 22
_OFTEN: Final = 0.4
"""Share of the times at which something comes that may come at any time."""
_ATTEMPTS: Final = 12
_SHOWN: Final = 6
"""So many of the last requests are in the message."""


_ONWARDS: Final = {
    Life.CONFIGURED: LifeRequest.ACTIVATE,
    Life.ACTIVE: LifeRequest.DEACTIVATE,
    Life.FAULTED: LifeRequest.ACKNOWLEDGE,
}


class Port(ABC, Generic[RigT]):
    """What a port's own suite does with an adapter in the course of its life, and looks at."""

    def may_use(self, rig: RigT) -> bool:
        """Whether the device may be used at all."""
        return True

    @abstractmethod
    def use(self, rig: RigT) -> object:
        """What the port is there for: one reading, or one command to stay."""

    def begun(self, rig: RigT) -> None:
        """It was just activated."""

    @abstractmethod
    def works(self, rig: RigT) -> None:
        """Fail the clause unless the active device does what it did before, if it does not do more."""

    def busy(self, rig: RigT) -> None:
        """Something is under way in the active device when this returns."""

    def upset(self, rig: RigT) -> None:
        """Something that may come in any state."""

    def rests(self, rig: RigT) -> None:
        """Fail the clause if something has moved that was not told to."""


class Lives:
    """An adapter that was just constructed, and what must be true of it after each step.

    Args:
        refusing: States in which everything that they do not allow is tried, too.
    """

    def __init__(self, port: Port[Any], rig: DeviceRig[Any], refusing: tuple[Life, ...]) -> None:
        self._random = Random(_SEED)
        self._port, self._rig, self._refusing = port, rig, refusing
        self._life, self._cause, self._done = Life.CONSTRUCTED, "", list[str]()
        self._whose = ""

    def ask(self, request: LifeRequest, *, look: bool = True) -> None:
        """Ask for what the state allows, and look at what became of it."""
        self._done.append(f"{request.value}()")
        require_quiet(self._clause, getattr(self._rig.device, request.value), f"{self._done[-1]} to work")
        self._life, self._cause = TRANSITIONS[self._life, request], ""
        if self._life is Life.ACTIVE:
            self._rig.advance(1)
            self._port.begun(self._rig)
        if not look:
            return
        self.look()
        self._rig.advance(1)
        self._port.rests(self._rig)

    def interrupt(self, request: LifeRequest) -> None:
        """Ask for something in the middle of its work."""
        if self._port.may_use(self._rig):
            self._port.busy(self._rig)
        self.ask(request)

    def work(self) -> None:
        """Use the active device as it is meant to be used."""
        self._done.append("use")
        if self._port.may_use(self._rig):
            self._port.works(self._rig)
        self.look()

    def shuffled(self, choices: Iterable[T]) -> list[T]:
        """All of them, in an order that is drawn."""
        drawn = list(choices)
        self._random.shuffle(drawn)
        return drawn

    def upset(self) -> None:
        """Do what may come in any state."""
        self._done.append("upset")
        self._port.upset(self._rig)
        self.look()
        self._rig.advance(1)
        self._port.rests(self._rig)

    def now_and_then_upset(self) -> None:
        """Do that, or do not, as it is drawn."""
        if self._random.random() < _OFTEN:
            self.upset()

    def fail(self) -> None:
        """Make the active device fail in the middle of its work."""
        self._done.append("fault")
        if self._port.may_use(self._rig):
            self._port.busy(self._rig)
        knob(self._rig.provoke_fault, "provoke_fault")()
        self._life, self._cause = Life.FAULTED, str(self._rig.device.fault or "")
        require(self._clause, says_something(self._cause), f"fault {self._cause!r}", "the cause of the fault in words")
        self._port.rests(self._rig)
        self.look()

    def fail_again(self) -> None:
        """What fails after the fault does not hide why it came."""
        self._done.append("another fault")
        with suppress(DeviceError, LifecycleError):
            knob(self._rig.provoke_fault, "provoke_fault")()
        self._rig.advance(1)
        self.look()

    def fail_at_rest(self) -> None:
        """Make it fail while it is configured, which is found when it is activated, if not before."""
        if self._rig.fail_at_rest is not None:
            self._done.append("fault at rest")
            self._rig.fail_at_rest()
            if self._rig.device.life is not Life.FAULTED:
                with suppress(DeviceError):
                    self._try(_ONWARDS[self._life])
            self._take(Life.FAULTED)
            self.look()
            self.ask(LifeRequest.ACKNOWLEDGE)

    def replug(self, before: str, upset: bool, onwards: bool) -> None:
        """Cut the cable of an active device and plug it in again: a fault may come of that, and nothing else."""
        rig = self._rig
        if before == "stop" and self._port.may_use(rig):
            self._port.busy(rig)
            self.upset()
        elif before == "fault" and rig.provoke_fault is not None:
            self.fail()
        elif before == "deactivate":
            self.interrupt(LifeRequest.DEACTIVATE)
        self._done.append("cut")
        knob(rig.disconnect, "disconnect")()
        pass_time(rig, rig.patience_ns)
        self._take(self._life)
        for _ in range(self._random.randrange(3) if self._port.may_use(rig) else 0):
            with suppress(DeviceError, LifecycleError):  # that it raises each time has a clause of its own
                self._port.use(rig)
            self._take(self._life)
        if upset:
            self.upset()
        if onwards:
            with suppress(DeviceError):
                self._try(_ONWARDS[self._life])
        self._done.append("plugged in")
        knob(rig.reconnect, "reconnect")()
        pass_time(rig, rig.patience_ns)
        self._take(self._life)
        self.look()

    def recover(self) -> None:
        """Lead it to where it works, as a person would."""
        for _ in range(_ATTEMPTS):
            try:
                if self._life is not Life.ACTIVE:
                    revive(self._rig, self._try)
                self._done.append("use")
                if self._port.may_use(self._rig):
                    self._port.works(self._rig)
                return self.look()
            except DeviceError:
                self._take(Life.FAULTED)
        raise ContractViolation(self._clause, f"{self._life} still", "it to work again once it is plugged in")

    def _try(self, request: LifeRequest) -> None:
        """Ask for what the state allows, and look at what became of it; a dead link may make it fail."""
        self._done.append(f"{request.value}()")
        here, self._cause = self._life, "" if self._life is Life.FAULTED else self._cause
        try:
            getattr(self._rig.device, request.value)()
            self._take(TRANSITIONS[here, request])
        except DeviceError:
            self._take(here)
            raise
        except (ContractViolation, SkipTest):
            raise
        except Exception as error:
            raise ContractViolation(self._clause, repr(error), "DeviceError, or none") from error

    def _take(self, life: Life) -> None:
        """The state is this one, or a fault has been found; nothing has moved."""
        found = self._rig.device.life
        require(self._clause, found in (life, Life.FAULTED), f"{found}", f"{life}, or a fault")
        if found is Life.ACTIVE and self._life is not found:
            self._rig.advance(1)
            self._port.begun(self._rig)
        self._life = found
        self._cause = (self._cause or str(self._rig.device.fault)) if found is Life.FAULTED else ""
        self._require_state("")
        self._port.rests(self._rig)

    def look(self) -> None:
        """The state is that of the table; what it does not allow is refused, by name, and changes nothing."""
        self._require_state("")
        if self._life in self._refusing:
            refused = [request for request in LifeRequest if (self._life, request) not in TRANSITIONS]
            self._random.shuffle(refused)
            for request in refused:
                # What is missing has a clause of its own.
                action = getattr(self._rig.device, request.value, None)
                if action is not None:
                    self._require_refused(f"{request.value}()", action, request is LifeRequest.ACTIVATE)
            if self._life is not Life.ACTIVE and self._port.may_use(self._rig):
                self._require_refused("reading or sending", lambda: self._port.use(self._rig), True)
        self._port.rests(self._rig)

    @property
    def _clause(self) -> str:
        return f"life ({', '.join(self._done[-_SHOWN:]) or 'constructed'})"

    def _require_refused(self, what: str, action: Callable[[], object], tells_fault: bool) -> None:
        kind: Any = LifecycleError
        if self._life is Life.FAULTED:
            kind = FaultLatchedError if tells_fault else (LifecycleError, FaultLatchedError)
        names = "FaultLatchedError" if kind is FaultLatchedError else "LifecycleError"
        error = require_raises(self._clause, kind, action, f"{names} for {what} while {self._life.value}")
        whose = str(error).partition(": ")[0]
        self._whose = self._whose or whose
        named = bool(whose.strip()) and whose == self._whose
        require(self._clause, named, f"an error of {whose!r}", f"one of {self._whose or 'the device'!r}, by its name")
        if isinstance(error, FaultLatchedError):
            told = error.cause == self._cause
            require(self._clause, told, f"{error.cause!r} as the cause", f"the fault's own, {self._cause!r}")
        self._require_state(f" after {what} was refused")

    def _require_state(self, after: str) -> None:
        device = self._rig.device
        try:
            life, fault = device.life, device.fault
        except Exception as error:
            raise ContractViolation(self._clause, f"{error!r} of life or fault{after}", "both at any time") from error
        require(self._clause, life is self._life, f"{life}{after}", str(self._life))
        # What a closed device says of its last fault is its own affair.
        if self._life is not Life.CLOSED:
            require(self._clause, (fault or "") == self._cause, f"fault {fault!r}{after}", repr(self._cause or None))


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


def replug(rig: DeviceRig[Any]) -> None:
    """Cut the cable of an active device, plug it in again and make it active anew; nothing where the rig cannot."""
    if rig.disconnect is not None and rig.reconnect is not None:
        rig.disconnect()
        pass_time(rig, rig.patience_ns)
        rig.reconnect()
        pass_time(rig, rig.patience_ns)
        revive(rig)


def revive(rig: DeviceRig[Any], ask: Callable[[LifeRequest], object] | None = None) -> None:
    """Lead a device on until it was activated anew; a link that is dead may be found and made anew on the way.

    Args:
        ask: Makes a request, and looks at what became of it; None makes it, and lets a tick go by.
    """
    for attempt in range(_ATTEMPTS):
        request = _ONWARDS[rig.device.life]
        with suppress(*(DeviceError,) if attempt < _ATTEMPTS - 1 else ()):
            if ask is None:
                getattr(rig.device, request.value)()
                rig.advance(1)
            else:
                ask(request)
            if request is LifeRequest.ACTIVATE:
                return
