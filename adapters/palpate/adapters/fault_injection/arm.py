"""An arm port with faults on the way of its commands."""

from collections import deque
from collections.abc import Sequence
from math import nan
from typing import TypeAlias

from typing_extensions import override

from palpate.adapters.fault_injection.plan import FaultPlan
from palpate.adapters.fault_injection.sample_faults import changed
from palpate.adapters.fault_injection.schedule import FaultMoment, Notify, Schedule, Ticker, schedules
from palpate.core.errors import DeviceError, PalpateError
from palpate.core.ports import (
    AppliedCommand,
    ArmCommand,
    Clock,
    CommandReason,
    DeviceDecorator,
    JointCommand,
    JointVector,
    Life,
)

_OnWay: TypeAlias = JointCommand | None


class CommandFault:
    """One fault on the way of the commands. None stands for a command that does not arrive.

    Attributes:
        lies: Whether the answer is that the command was applied as asked, as that of a bus that only queues it; an arm
            that takes the numbers for those of another unit answers what it makes of them.
    """

    def __init__(self, plan: FaultPlan) -> None:
        self._plan, self.lies = plan, plan.kind != "unit"
        self._under_way: deque[tuple[int, JointCommand]] = deque()

    def strike(self, command: _OnWay, moment: FaultMoment, held_rad: JointVector | None) -> _OnWay:
        """What goes on instead of a command.

        Args:
            held_rad: What the arm applied last, (n,); None before its first command.

        Raises:
            DeviceError: The arm is gone.
            CommandError: Something on the way makes NaN of the command; none such can be made, so it is refused.
        """
        plan = self._plan
        match plan.kind:
            case "drop":
                return None
            case "delay":
                return self._late(command, moment.tick)
            case "stuck":
                # The link lives and the arm stands: it is sent again what it holds already.
                return None if held_rad is None else JointCommand(held_rad)
            case "disconnect":
                raise DeviceError(plan.port, "does not answer")
        factor = nan if plan.kind == "nan" else plan.factor
        return command and JointCommand(changed(command.position_rad, plan.channels, lambda i, value: factor * value))

    def clear(self) -> None:
        """The arm was stopped, or the fault is over: nothing old may arrive any more."""
        self._under_way.clear()

    def _late(self, command: _OnWay, tick: int) -> _OnWay:
        due, queue = tick + self._plan.delay_ticks, self._under_way
        if command is not None:
            # The newest command of a tick wins, late or not.
            if queue and queue[-1][0] == due:
                queue.pop()
            queue.append((due, command))
        arrived: _OnWay = None
        while queue and queue[0][0] <= tick:
            arrived = queue.popleft()[1]
        return arrived


class FaultyArm(DeviceDecorator, ArmCommand):
    """An arm with faults. A stop always reaches it, and nothing that was under way arrives after one.

    Args:
        plans: Its faults, in the order in which a command meets them.

    Raises:
        ConfigurationError: A plan is for another port.
    """

    def __init__(self, arm: ArmCommand, clock: Clock, plans: Sequence[FaultPlan], notify: Notify | None = None) -> None:
        super().__init__(arm)
        self._arm, self._ticker = arm, Ticker(clock)
        self._stages: list[tuple[Schedule, CommandFault]] = [
            (schedule, CommandFault(schedule.plan)) for schedule in schedules("arm", plans, notify)
        ]
        self._held: JointVector | None = None
        self._stopped = False

    @override
    def activate(self) -> None:
        super().activate()
        self._begin_anew()

    @override
    def send(self, command: JointCommand) -> AppliedCommand:
        """Send a command past the faults.

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
        # That the arm is stopped is answered whatever the fault: only a broken link may hide it.
        return AppliedCommand(command.position_rad) if lied and applied.reason is not CommandReason.STOPPED else applied

    @override
    def stop(self) -> None:
        self._stopped = True
        self._arm.stop()

    def _struck(self, command: JointCommand) -> tuple[JointCommand | None, bool]:
        """What arrives at the arm, and whether the answer is another."""
        moment, lied = self._ticker.moment(), False
        on_way: JointCommand | None = command
        for schedule, fault in self._stages:
            if not schedule.strikes(moment):
                fault.clear()
                continue
            before = on_way
            try:
                on_way = fault.strike(before, moment, self._held)
            except PalpateError:
                schedule.delivered(moment)
                raise
            if on_way is not before:
                schedule.delivered(moment)
                lied = lied or fault.lies
        return on_way, lied

    def _sent_plainly(self, command: JointCommand) -> AppliedCommand:
        applied = self._arm.send(command)
        if self._stopped and applied.reason is not CommandReason.STOPPED:
            # The arm underneath was activated again.
            self._begin_anew()
        self._held = applied.position_rad
        return applied

    def _begin_anew(self) -> None:
        self._held, self._stopped = None, False
        for _, fault in self._stages:
            fault.clear()
