"""The life of every device adapter, as one table.

``construct`` opens nothing; ``configure`` opens and checks the device; ``activate`` lets it act;
``deactivate`` ends that; ``close`` releases it for good. A fault latches: only ``acknowledge_fault``,
called by a person's decision, leads out of it, and it leads to *configured*, never to *active*.
"""

import enum
from abc import abstractmethod
from collections.abc import Callable
from typing import Final, Self

from palpate.core.errors import FaultLatchedError, LifecycleError


class Life(enum.Enum):
    """States of a device adapter."""

    CONSTRUCTED = "constructed"
    CONFIGURED = "configured"
    ACTIVE = "active"
    FAULTED = "faulted"
    CLOSED = "closed"


class LifeRequest(enum.Enum):
    """What a caller may ask for."""

    CONFIGURE = "configure"
    ACTIVATE = "activate"
    DEACTIVATE = "deactivate"
    ACKNOWLEDGE = "acknowledge_fault"
    CLOSE = "close"


TRANSITIONS: Final[dict[tuple[Life, LifeRequest], Life]] = {
    (Life.CONSTRUCTED, LifeRequest.CONFIGURE): Life.CONFIGURED,
    (Life.CONFIGURED, LifeRequest.ACTIVATE): Life.ACTIVE,
    (Life.ACTIVE, LifeRequest.DEACTIVATE): Life.CONFIGURED,
    (Life.FAULTED, LifeRequest.ACKNOWLEDGE): Life.CONFIGURED,
    (Life.CONSTRUCTED, LifeRequest.CLOSE): Life.CLOSED,
    (Life.CONFIGURED, LifeRequest.CLOSE): Life.CLOSED,
    (Life.ACTIVE, LifeRequest.CLOSE): Life.CLOSED,
    (Life.FAULTED, LifeRequest.CLOSE): Life.CLOSED,
    (Life.CLOSED, LifeRequest.CLOSE): Life.CLOSED,
}


class ActiveInside:
    """Makes a context manager of a device: active inside, closed on every way out."""

    @abstractmethod
    def configure(self) -> None:
        """Open and check the device."""

    @abstractmethod
    def activate(self) -> None:
        """Let it act."""

    @abstractmethod
    def close(self) -> None:
        """Release it for good."""

    def __enter__(self) -> Self:
        try:
            self.configure()
            self.activate()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class ManagedDevice(ActiveInside):
    """Base of our adapters: keeps the life-cycle state and refuses illegal requests.

    A subclass overrides the ``_on_...`` hooks it needs. Used as a context manager it is configured
    and activated on entry and closed on every way out.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self._life = Life.CONSTRUCTED
        self._fault: str | None = None
        self._faulted_meanwhile = False

    @property
    def life(self) -> Life:
        """Where in its life the device is."""
        return self._life

    @property
    def fault(self) -> str | None:
        """The latched fault, or None."""
        return self._fault

    def configure(self) -> None:
        """Open and check the device.

        Raises:
            LifecycleError: It is not freshly constructed.
        """
        self._move(LifeRequest.CONFIGURE, self._on_configure)

    def activate(self) -> None:
        """Let the device act.

        Raises:
            LifecycleError: It is not configured.
            FaultLatchedError: A fault has not been acknowledged.
        """
        self._move(LifeRequest.ACTIVATE, self._on_activate)

    def deactivate(self) -> None:
        """End what ``activate`` began.

        Raises:
            LifecycleError: It is not active.
        """
        self._move(LifeRequest.DEACTIVATE, self._on_deactivate)

    def acknowledge_fault(self) -> None:
        """Clear a latched fault; a person's decision, never a program's.

        Raises:
            LifecycleError: There is no fault.
        """
        cause, self._fault = self._fault, None
        try:
            self._move(LifeRequest.ACKNOWLEDGE, self._on_acknowledge)
        finally:
            # Refused, or failed again on the way: then there still is a fault.
            if self._life is Life.FAULTED:
                self._fault = self._fault or cause

    def close(self) -> None:
        """Release the device for good; allowed at any time, twice too."""
        if self._life is not Life.CLOSED:
            try:
                self._on_close()
            finally:
                self._life = TRANSITIONS[self._life, LifeRequest.CLOSE]

    def _latch(self, cause: str) -> None:
        """Enter the faulted state; the first cause is kept. A device that is not open has nothing to fail."""
        if self._life not in (Life.CONSTRUCTED, Life.CLOSED):
            # The cause first: another thread that finds the fault finds its cause.
            self._fault = self._fault or cause
            self._life, self._faulted_meanwhile = Life.FAULTED, True

    def _require_active(self, request: str) -> None:
        if self._life is not Life.ACTIVE:
            self._refuse(request, "configure() and activate() it first")

    def _move(self, request: LifeRequest, hook: Callable[[], None]) -> None:
        target = TRANSITIONS.get((self._life, request))
        if target is None:
            able = ", ".join(r.value + "()" for (life, r) in TRANSITIONS if life is self._life)
            self._refuse(request.value + "()", f"possible now: {able}")
        else:
            self._faulted_meanwhile = False
            hook()
            if not self._faulted_meanwhile:
                self._life = target

    def _refuse(self, request: str, accepted: str) -> None:
        if self._life is Life.FAULTED and self._fault is not None:
            raise FaultLatchedError(self.name, self._fault)
        raise LifecycleError(self.name, self._life.value, request, accepted)

    def _on_configure(self) -> None: ...

    def _on_activate(self) -> None: ...

    def _on_deactivate(self) -> None: ...

    def _on_acknowledge(self) -> None: ...

    def _on_close(self) -> None: ...
