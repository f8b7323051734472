"""An arm port with faults."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from palpate.adapters.fault_injection.command_faults import (
    CommandFault,
    DelayCommand,
    DisconnectArm,
    DropCommand,
    NotANumberCommand,
    Stuck,
    WrongUnitCommand,
)
from palpate.adapters.fault_injection.plan import FaultPlan
from palpate.adapters.fault_injection.schedule import FaultAccount, FaultDelivery, Schedule, Tell, Ticker
from palpate.core.errors import PalpateError
from palpate.core.ports.decorator import DeviceDecorator
from palpate.core.ports.devices import ArmCommand, Clock
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import AppliedCommand, CommandReason, JointCommand, JointVector

_FAULTS: Final[dict[str, type[CommandFault]]] = {
    "drop": DropCommand,
    "delay": DelayCommand,
    "nan": NotANumberCommand,
    "unit": WrongUnitCommand,
    "disconnect": DisconnectArm,
    "stuck": Stuck,
}


class FaultyArm(DeviceDecorator, ArmCommand):
    """An arm with faults. A stop always reaches it, and nothing that was under way arrives after one.

    Args:
        arm: The arm.
        clock: The run's clock.
        plans: Its faults, in the order in which a command meets them.
        tell: Is told of each delivery.

    Raises:
        ConfigurationError: A plan is for another port.
    """

    def __init__(self, arm: ArmCommand, clock: Clock, plans: Sequence[FaultPlan], tell: Tell | None = None) -> None:
        super().__init__(arm)
        self._arm, self._ticker = arm, Ticker(clock)
        self._account = FaultAccount(tell)
        self._stages: list[tuple[Schedule, CommandFault]] = [
            (schedule, _FAULTS[schedule.plan.kind](schedule.plan)) for schedule in self._account.schedules("arm", plans)
        ]
        self._held: JointVector | None = None
        self._stopped = False

    @property
    def deliveries(self) -> list[FaultDelivery]:
        """What was delivered so far."""
        return self._account.deliveries

    def activate(self) -> None:
        """See :class:`palpate.core.ports.devices.Device`."""
        super().activate()
        self._begin_anew()

    def send(self, command: JointCommand) -> AppliedCommand:
        """See :class:`ArmCommand`.

        Raises:
            CommandError: Besides the arm's own: a fault made NaN of the command.
            DeviceError: Besides the arm's own: a fault has disconnected it.
        """
        if not self._stages or self._stopped or self._arm.life is not Life.ACTIVE:
            return self._sent_plainly(command)
        arriving, lied = self._struck(command)
        if arriving is None:
            return AppliedCommand(command.position_rad)
        applied = self._arm.send(arriving)
        self._held = applied.position_rad
        # An arm that is stopped says so whatever the fault: only a broken link may lie about that.
        return AppliedCommand(command.position_rad) if lied and applied.reason is not CommandReason.STOPPED else applied

    def stop(self) -> None:
        """See :class:`ArmCommand`."""
        self._stopped = True
        self._arm.stop()

    def _struck(self, command: JointCommand) -> tuple[JointCommand | None, bool]:
        """What arrives at the arm, and whether the caller hears something else."""
        moment, lied = self._ticker.moment(), False
        on_way: JointCommand | None = command
        for schedule, fault in self._stages:
            if not schedule.strikes(moment):
                fault.forget()
                continue
            before = on_way
            try:
                on_way = fault.strike(before, moment, self._held)
            except PalpateError:
                schedule.delivered(moment)
                raise
            if on_way is not before:
                schedule.delivered(moment)
                lied = lied or fault.LIES
        return on_way, lied

    def _sent_plainly(self, command: JointCommand) -> AppliedCommand:
        applied = self._arm.send(command)
        if self._stopped and applied.reason is not CommandReason.STOPPED:
            # Somebody has activated the arm again underneath.
            self._begin_anew()
        self._held = applied.position_rad
        return applied

    def _begin_anew(self) -> None:
        self._held, self._stopped = None, False
        for _, fault in self._stages:
            fault.forget()
