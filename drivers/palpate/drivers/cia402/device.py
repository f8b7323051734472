"""An arm of CiA 402 drives: configured, enabled, moved in cycles, and stopped on any error.

One thread uses an arm. What the drives say comes in through the receive thread of the bus and is copied there
(:mod:`palpate.drivers.cia402.mailbox`); everything else happens in the caller's own thread, in :meth:`Cia402Arm.cycle`.
"""

import contextlib
import time
from collections.abc import Callable, Sequence
from typing import Final

from typing_extensions import override

from palpate.drivers.cia402.bring_up import BringUp
from palpate.drivers.cia402.codec import FAULTS, Controlword, DriveState
from palpate.drivers.cia402.exchange import CyclicExchange
from palpate.drivers.cia402.link import CanopenLink
from palpate.drivers.cia402.settings import ArmSettings
from palpate.drivers.cia402.watch import outside, trouble
from palpate.drivers.device import ArmState, LatchingArm, Measured, clamped, held_back, require_angles
from palpate.drivers.errors import DriverError, SilentError, StateError

_CONTROLWORD: Final = {
    ArmState.CONFIGURED: Controlword.DISABLE_VOLTAGE,
    ArmState.ENABLED: Controlword.ENABLE_OPERATION,
    ArmState.STOPPED: Controlword.QUICK_STOP,
}
_AT_REST: Final = (DriveState.QUICK_STOP, DriveState.SWITCH_ON_DISABLED)


class Cia402Arm(LatchingArm):
    """An arm of CiA 402 drives. It neither opens nor closes its bus, which other devices may use, too.

    Args:
        sleep: Waits for a number of seconds; only used outside the cycle.
    """

    def __init__(
        self,
        link: CanopenLink,
        settings: ArmSettings,
        *,
        now_ns: Callable[[], int] = time.monotonic_ns,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        super().__init__()
        self.settings = settings
        self._link = link
        self._now_ns = now_ns
        self._exchange = CyclicExchange(link, settings, now_ns)
        self._bring_up = BringUp(link, settings, self._exchange, now_ns, sleep)
        self._cycles_since_stop = self._stepped_ns = 0

    @property
    @override
    def notes(self) -> tuple[str, ...]:
        return self._bring_up.notes

    @override
    def diagnostics(self) -> dict[str, str]:
        found, settings = super().diagnostics(), self.settings
        known = zip(settings.joints, self._bring_up.identities, strict=False)
        found["drives"] = ", ".join(f"{joint.node} {name}" for joint, name in known)
        missing = zip(settings.joints, self._exchange.missing, strict=True)
        lacking = ", ".join(f"{count} of drive {joint.node}" for joint, count in missing if count)
        found["answers"] = f"{self._exchange.cycles} cycles; missing: {lacking or 'none'}"
        found["fault"] = found["fault"] or self._shown()
        return found

    def _shown(self) -> str:
        """Return the problem of the drives, whether or not they have power; empty if there is none."""
        for view, joint in zip(self._exchange.views, self.settings.joints, strict=False):
            if view.state in FAULTS:
                return f"drive {joint.node} is in fault; look its code up in the drive's manual (object 0x603F)"
            if view.position_rad is not None and outside(view.position_rad, joint):
                return f"drive {joint.node} is at {view.position_rad:.4f} rad, beyond the joint's limits"
        return ""

    def open(self) -> None:
        """Find and configure the drives, and wait for data of each, without switching power on."""
        self._require("open()", ArmState.NEW)
        self._link.require_alive()
        self._exchange.listen()
        self._bring_up.identify()
        self._bring_up.prepare()
        self._state = ArmState.CONFIGURED

    def enable(self) -> None:
        """Put the drives under power where they are; nothing moves.

        Afterwards :meth:`cycle` has to be called without long pauses: it is what keeps the drives' watchdog calm.
        """
        self._require("enable()", ArmState.CONFIGURED)
        with self._latching():
            views = self._bring_up.look()
            self._judge(None)
        for view, joint in zip(views, self.settings.joints, strict=True):
            if view.position_rad is None or outside(view.position_rad, joint):
                problem = f"is at {view.position_rad} rad, outside {joint.lower_rad} to {joint.upper_rad}"
                raise StateError(f"drive {joint.node}", problem, "move the joint back by hand, or correct zero_counts")
        with self._latching():
            self._bring_up.watchdogs(on=True)
            self._bring_up.walk(DriveState.ENABLED)
        # The very place that the drives have as their target, not a newer measurement: no count of difference.
        self.setpoint_rad = self._bring_up.held_rad
        self._stepped_ns = self._now_ns() - self.settings.period_ns
        self._state = ArmState.ENABLED

    def cycle(self, setpoint_rad: Sequence[float] | None = None, /) -> Measured:
        """One cycle: write set-points, send SYNC, wait for the drives' answers.

        The set-point takes effect at this SYNC, and the angles are those of the same moment, so they do not depend
        on it. Without a set-point an enabled arm keeps its last one. Called sooner than a period after the last, it
        shortens the step in proportion.
        """
        self._require("cycle()", ArmState.CONFIGURED, ArmState.ENABLED, ArmState.STOPPED)
        now_ns, joints = self._now_ns(), self.settings.joints
        step_s = min((now_ns - self._stepped_ns) * 1e-9, self.settings.period_s)
        targets, enabled = self._exchange.hold(), self._state is ArmState.ENABLED
        if setpoint_rad is not None:
            self._require("a set-point", ArmState.ENABLED, ArmState.STOPPED)
            asked_rad = require_angles(setpoint_rad, len(joints))
            within_rad = clamped(asked_rad, [each.lower_rad for each in joints], [each.upper_rad for each in joints])
            if enabled:
                most_rad = [joint.velocity_rad_per_s * step_s for joint in joints]
                self.setpoint_rad = held_back(within_rad, self.setpoint_rad, most_rad)
        self._stepped_ns = now_ns
        if enabled:
            targets = tuple(joint.counts(angle) for joint, angle in zip(joints, self.setpoint_rad, strict=True))
        with self._latching():
            self._exchange.run([_CONTROLWORD[self._state]] * len(targets), targets)
            self._judge(self._allowed())
        return Measured(self._positions_rad(), self._exchange.sync_ns)

    def stop(self) -> None:
        """Quick-stop every drive. Never raises; works in every state, twice too, and when the bus is gone.

        An enabled arm is *stopped* afterwards: it stays under power and holds still, and no set-point is applied
        until :meth:`disable` and :meth:`enable`.
        """
        if self._state in (ArmState.NEW, ArmState.CLOSED):
            return
        if self._state is ArmState.ENABLED:
            self._state, self._cycles_since_stop = ArmState.STOPPED, 0
        self._exchange.broadcast(Controlword.QUICK_STOP)

    def disable(self) -> None:
        """Stop, wait for standstill, take the power away. Holding the joints is then the brakes' business."""
        self._require("disable()", ArmState.CONFIGURED, ArmState.ENABLED, ArmState.STOPPED)
        if self._state is ArmState.CONFIGURED:
            return
        self.stop()
        with self._latching():
            self._bring_up.come_to_rest()
            self._bring_up.walk(DriveState.SWITCH_ON_DISABLED)
            self._bring_up.watchdogs(on=False)
        self._state = ArmState.CONFIGURED

    def acknowledge(self) -> None:
        """Clear a latched fault, as decided by a person, never by a program.

        The drives are set up again, since one may have restarted, and get a fault-reset. They end without power.
        """
        self._require_fault()
        self._link.require_alive()
        self._bring_up.prepare()
        self._bring_up.walk(DriveState.SWITCH_ON_DISABLED, by_operator=True)
        self._state, self.fault = ArmState.CONFIGURED, None

    def close(self) -> None:
        """Stop, take the power away as far as the bus still allows, and end all traffic; twice too. Never raises."""
        if self._state in (ArmState.NEW, ArmState.CLOSED):
            self._state = ArmState.CLOSED
            return
        self.stop()
        if self._state is not ArmState.CONFIGURED:
            with contextlib.suppress(DriverError):
                self._bring_up.come_to_rest()
        # One dead drive must not keep the others under power.
        with contextlib.suppress(DriverError):
            self._bring_up.shut_down()
        self._bring_up.hang_up()
        self._state = ArmState.CLOSED

    def _allowed(self) -> tuple[DriveState, ...] | None:
        if self._state is ArmState.ENABLED:
            return (DriveState.ENABLED,)
        if self._state is ArmState.STOPPED:
            self._cycles_since_stop += 1
            # One lost frame may keep the order from a drive for a moment, not for long.
            heard = self._cycles_since_stop > self.settings.missed_cycles
            return _AT_REST if heard else (*_AT_REST, DriveState.ENABLED)
        return None

    def _judge(self, allowed: tuple[DriveState, ...] | None) -> None:
        error = trouble(self._exchange.views, self.settings, self._now_ns(), allowed)
        if error is not None:
            raise error

    def _positions_rad(self) -> tuple[float, ...]:
        known = [view.position_rad for view in self._exchange.views if view.position_rad is not None]
        if len(known) != len(self.settings.joints):
            raise SilentError("arm", "not every drive has told its position", "check the bus")
        return tuple(known)
