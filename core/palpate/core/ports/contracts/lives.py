"""Whole lives of an adapter, held step by step against the table of :mod:`palpate.core.ports.lifecycle`.

The order of what is tried is drawn from a seed, so that it is another at each step and the same at each run.
"""

from collections.abc import Callable
from random import Random
from typing import Any, Final, Protocol

from palpate.core.errors import FaultLatchedError, LifecycleError
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

_SEED: Final = 22
_OFTEN: Final = 0.4
"""Share of the times at which something comes that may come at any time."""
_SHOWN: Final = 6
"""So many of the last requests are in the message."""


class Port(Protocol):
    """What a port's own suite does with an adapter in the course of its life, and looks at."""

    def may_use(self, rig: Any) -> bool:
        """Whether the device may be used at all."""
        ...

    def use(self, rig: Any) -> object:
        """One reading, or one command."""
        ...

    def begun(self, rig: Any) -> None:
        """It has just been activated."""

    def works(self, rig: Any) -> None:
        """The active device still does what it did before."""

    def busy(self, rig: Any) -> None:
        """Something is under way in the active device when this returns."""

    def upset(self, rig: Any) -> None:
        """Something that may come in any state."""

    def rests(self, rig: Any) -> None:
        """Nothing has moved that was not told to."""


class Lives:
    """An adapter that was just constructed, and what must be true of it after each step.

    Args:
        refusing: States in which everything that they do not allow is tried, too.
    """

    def __init__(self, port: Port, rig: DeviceRig[Any], refusing: tuple[Life, ...]) -> None:
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
