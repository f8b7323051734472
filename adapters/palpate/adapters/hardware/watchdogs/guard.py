"""An arm that stays at rest while a trip is latched."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Protocol

from palpate.adapters.hardware.watchdogs.trip import Latching, WatchdogTrip, stop_surely
from palpate.core.errors import FaultLatchedError
from palpate.core.ports.decorator import DeviceDecorator
from palpate.core.ports.devices import ArmCommand
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import AppliedCommand, JointCommand


class Resting(Protocol):
    """A watchdog that need not be fed for a while."""

    @abstractmethod
    def rest(self) -> None:
        """Nobody need feed until the next feeding."""


class GuardedArm(DeviceDecorator, ArmCommand):
    """Neither activates nor moves the arm until every trip is acknowledged.

    Args:
        arm: The arm.
        latches: What may have tripped.
        resting: Watchdogs of the loop, which rests when the arm was stopped.
    """

    def __init__(self, arm: ArmCommand, latches: Sequence[Latching], resting: Sequence[Resting] = ()) -> None:
        super().__init__(arm)
        self._arm, self._latches, self._resting = arm, tuple(latches), tuple(resting)

    def activate(self) -> None:
        """See :class:`palpate.core.ports.devices.Device`.

        Raises:
            FaultLatchedError: Besides the arm's own: a trip waits to be acknowledged.
        """
        trip = self._tripped()
        # A request that is wrong anyway is refused by the arm, which knows why.
        if trip is not None and self._arm.life is Life.CONFIGURED:
            raise FaultLatchedError("arm", f"{trip.source}: {trip.text}")
        super().activate()

    def send(self, command: JointCommand) -> AppliedCommand:
        """See :class:`ArmCommand`. While a trip is latched the arm is stopped, and says so."""
        if self._tripped() is not None:
            # Somebody may have activated it underneath since it was stopped.
            stop_surely(self._arm)
        return self._arm.send(command)

    def stop(self) -> None:
        """See :class:`ArmCommand`."""
        self._arm.stop()
        for watchdog in self._resting:
            watchdog.rest()

    def _tripped(self) -> WatchdogTrip | None:
        return next((latch.tripped for latch in self._latches if latch.tripped is not None), None)
