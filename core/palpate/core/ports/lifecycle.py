"""The life cycle shared by all device adapters, defined in a table.

``construct`` opens nothing; ``configure`` opens and checks the device; ``activate`` enables it; ``deactivate`` undoes
that; ``close`` releases the device permanently. A fault latches. Only ``acknowledge_fault``, a person's decision,
clears it. The state is then *configured*, never *active*.
"""

import enum
from abc import abstractmethod
from collections.abc import Callable
from typing import Final, Protocol, Self, runtime_checkable

from typing_extensions import override

from palpate.core.errors import FaultLatchedError, LifecycleError


class Life(enum.Enum):
    """Device adapter states."""

    CONSTRUCTED = "constructed"
    CONFIGURED = "configured"
    ACTIVE = "active"
    FAULTED = "faulted"
    CLOSED = "closed"


class LifeRequest(enum.Enum):
    """Requests to a device adapter."""

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


@runtime_checkable
class Device(Protocol):
    """Life cycle shared by the three device ports."""

    @property
    @abstractmethod
    def life(self) -> Life:
        """Return the device's life-cycle state."""

    @property
    @abstractmethod
    def fault(self) -> str | None:
        """Return the latched fault, or None."""

    @abstractmethod
    def configure(self) -> None:
        """Open and check the device; the constructor opens nothing."""

    @abstractmethod
    def activate(self) -> None:
        """Enable the device."""

    @abstractmethod
    def deactivate(self) -> None:
        """Undo ``activate``.

        Raises:
            LifecycleError: The device is not active.
        """

    @abstractmethod
    def acknowledge_fault(self) -> None:
        """Clear a latched fault; only a person may decide this.

        Raises:
            LifecycleError: There is no fault.
        """

    @abstractmethod
    def close(self) -> None:
        """Release the device permanently; allowed at any time, even repeatedly."""


class ActiveInside(Device, Protocol):
    """Base class that makes a device a context manager, active inside the block and closed on exit."""

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
    """Base class for palpate's adapters, which keeps the life-cycle state and rejects illegal requests.

    A subclass overrides the ``_on_...`` hooks that it needs. As a context manager it is configured and activated on
    entry and closed on exit.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self._life = Life.CONSTRUCTED
        self._fault: str | None = None
        self._faulted_meanwhile = False

    @property
    @override
    def life(self) -> Life:
        return self._life

    @property
    @override
    def fault(self) -> str | None:
        return self._fault

    @override
    def configure(self) -> None:
        self._move(LifeRequest.CONFIGURE, self._on_configure)

    @override
    def activate(self) -> None:
        self._move(LifeRequest.ACTIVATE, self._on_activate)

    @override
    def deactivate(self) -> None:
        self._move(LifeRequest.DEACTIVATE, self._on_deactivate)

    @override
    def acknowledge_fault(self) -> None:
        cause, self._fault = self._fault, None
        try:
            self._move(LifeRequest.ACKNOWLEDGE, self._on_acknowledge)
        finally:
            # The request was rejected or failed again: the fault remains.
            if self._life is Life.FAULTED:
                self._fault = self._fault or cause

    @override
    def close(self) -> None:
        if self._life is not Life.CLOSED:
            try:
                self._on_close()
            finally:
                self._life = TRANSITIONS[self._life, LifeRequest.CLOSE]

    def _latch(self, cause: str) -> None:
        """Enter the faulted state, and keep the first cause; do nothing if the device is not open."""
        if self._life not in (Life.CONSTRUCTED, Life.CLOSED):
            # Set the cause first, so that another thread that sees the fault also sees its cause.
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
