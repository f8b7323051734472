"""Faults on the way of commands to an arm."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from math import nan
from typing import ClassVar

from palpate.adapters.fault_injection.channels import changed
from palpate.adapters.fault_injection.plan import FaultPlan
from palpate.adapters.fault_injection.schedule import FaultMoment
from palpate.core.errors import DeviceError
from palpate.core.ports.values import JointCommand, JointVector


class CommandFault(ABC):
    """One fault on the way of the commands. None stands for a command that does not arrive.

    Args:
        plan: What it shall do.

    Attributes:
        LIES: Whether the caller hears that the command was applied as asked, as a bus does that only queues it.
    """

    LIES: ClassVar[bool] = True

    def __init__(self, plan: FaultPlan) -> None:
        self.plan = plan

    @abstractmethod
    def strike(
        self, command: JointCommand | None, moment: FaultMoment, held_rad: JointVector | None
    ) -> JointCommand | None:
        """What goes on instead of a command.

        Args:
            command: What came to here.
            moment: The tick.
            held_rad: What the arm applied last, (n,); None before its first command.
        """

    def forget(self) -> None:
        """The arm was stopped, or the fault is over: nothing old may arrive any more."""
        # Most faults keep nothing.
        return


class DropCommand(CommandFault):
    """The command is lost."""

    def strike(
        self, command: JointCommand | None, moment: FaultMoment, held_rad: JointVector | None
    ) -> JointCommand | None:
        """See :class:`CommandFault`."""
        return None


class DelayCommand(CommandFault):
    """Every command comes so many ticks late."""

    def __init__(self, plan: FaultPlan) -> None:
        super().__init__(plan)
        self._under_way: deque[tuple[int, JointCommand]] = deque()

    def strike(
        self, command: JointCommand | None, moment: FaultMoment, held_rad: JointVector | None
    ) -> JointCommand | None:
        """See :class:`CommandFault`."""
        due, queue = moment.tick + self.plan.delay_ticks, self._under_way
        if command is not None:
            # The newest command of a tick wins, late or not.
            if queue and queue[-1][0] == due:
                queue.pop()
            queue.append((due, command))
        arrived: JointCommand | None = None
        while queue and queue[0][0] <= moment.tick:
            arrived = queue.popleft()[1]
        return arrived

    def forget(self) -> None:
        """See :class:`CommandFault`."""
        self._under_way.clear()


class Stuck(CommandFault):
    """The link lives and the arm stands: it is told again what it holds already."""

    def strike(
        self, command: JointCommand | None, moment: FaultMoment, held_rad: JointVector | None
    ) -> JointCommand | None:
        """See :class:`CommandFault`."""
        return None if held_rad is None else JointCommand(held_rad)


class NotANumberCommand(CommandFault):
    """Something on the way makes NaN of a command; none such can be made, so it is refused."""

    def strike(
        self, command: JointCommand | None, moment: FaultMoment, held_rad: JointVector | None
    ) -> JointCommand | None:
        """See :class:`CommandFault`.

        Raises:
            CommandError: Always, if a command came to here.
        """
        return command and JointCommand(changed(command.position_rad, self.plan.channels, lambda i, value: nan))


class WrongUnitCommand(CommandFault):
    """The arm takes the numbers for those of another unit; what it makes of them is told truly."""

    LIES = False

    def strike(
        self, command: JointCommand | None, moment: FaultMoment, held_rad: JointVector | None
    ) -> JointCommand | None:
        """See :class:`CommandFault`."""
        factor = self.plan.factor
        return command and JointCommand(
            changed(command.position_rad, self.plan.channels, lambda i, value: factor * value)
        )


class DisconnectArm(CommandFault):
    """The arm is gone."""

    def strike(
        self, command: JointCommand | None, moment: FaultMoment, held_rad: JointVector | None
    ) -> JointCommand | None:
        """See :class:`CommandFault`.

        Raises:
            DeviceError: Always.
        """
        raise DeviceError(self.plan.port, "does not answer")
