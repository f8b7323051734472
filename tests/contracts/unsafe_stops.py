"""More arms that would hurt somebody, by their stops, their faults and what they remember of where they were."""

from math import pi, remainder
from threading import get_ident
from typing import Any

from palpate.core.ports import JointCommand, Life
from palpate.core.ports.contracts import TICK_NS
from tests.fake_devices import FakeArm


class StopsForItsThreadOnly(FakeArm):
    thread = 0

    def _on_configure(self) -> None:
        super()._on_configure()
        self.thread = get_ident()

    def stop(self) -> None:
        if self.thread not in (0, get_ident()):
            raise RuntimeError("used from another thread")
        super().stop()


class HearsItsThreadOnly(StopsForItsThreadOnly):
    def stop(self) -> None:
        if self.thread in (0, get_ident()):
            super().stop()


class FaultRunsOutItsMotion(FakeArm):
    """With a fault, it goes where it was sent, and does not hear a stop."""

    def fail(self, cause: str = "overload") -> None:
        self._latch(cause)

    def stop(self) -> None:
        if not self._fault:
            super().stop()


class FaultWearsOff(FakeArm):
    """A second later it is as if there had been no fault."""

    failed_ns = 0

    def fail(self, cause: str = "overload") -> None:
        super().fail(cause)
        self.failed_ns = self.clock.now_ns()

    def send(self, command: JointCommand) -> Any:
        if self._fault and self.clock.now_ns() > self.failed_ns + 140 * TICK_NS:
            self._fault, self._life = None, Life.ACTIVE
        return super().send(command)


class SendOutlastsStop(FakeArm):
    """A stop that comes while a command is on its way is overtaken by it."""

    def send(self, command: JointCommand) -> Any:
        stopped, applied = self._stopped, super().send(command)
        if not stopped:
            self._target_rad, self._target_since_ns = applied.position_rad, self.clock.now_ns()
        return applied


class StopReopens(FakeArm):
    """Closed, it opens once more to pass on a stop."""

    def stop(self) -> None:
        super().stop()
        self.is_open = True


class Parks(FakeArm):
    """Stopped and then closed, it drives to where it is parked."""

    def _on_close(self) -> None:
        super()._on_close()
        if self._stopped:
            self._target_rad, self._target_since_ns = (0.1, -0.2, 0.3), self.clock.now_ns()


class LimitsFromWhereItWas(FakeArm):
    """Turned by hand while it was not active, its first step is as long as the way back."""

    was_rad: Any = None

    def _on_deactivate(self) -> None:
        super()._on_deactivate()
        self.was_rad = self._target_rad

    def send(self, command: JointCommand) -> Any:
        was_rad, self.was_rad = self.was_rad, None
        if was_rad is None:
            return super().send(command)
        here, self._here_rad, self._target_rad = self._here_rad, was_rad, was_rad
        try:
            return super().send(command)
        finally:
            self._here_rad = here


class CannotLeaveItsLimit(FakeArm):
    """At a limit it refuses every further move, away from what it presses on too."""

    def send(self, command: JointCommand) -> Any:
        applied, here = super().send(command), self.position_rad()
        limits = zip(here, self._lower_rad, self._upper_rad, strict=True)
        if not self._stopped and any(q in (lower, upper) for q, lower, upper in limits):
            self._target_rad = here
            return applied._replace(position_rad=here)
        return applied


class TakesTheShortWayRound(FakeArm):
    """What is a turn too far is taken for what it would be a turn before."""

    def send(self, command: JointCommand) -> Any:
        return super().send(JointCommand(tuple(remainder(q, 2.0 * pi) for q in command.position_rad)))
