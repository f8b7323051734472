"""Driver for an arm with CiA 402 drives. It configures, enables and moves them in cycles, and stops on any error.

Each arm is used by a single thread. The bus's receive thread only copies the drives' messages
(:mod:`palpate.drivers.cia402.mailbox`). Everything else runs in the caller's thread, in :meth:`Cia402Arm.cycle`.
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
from palpate.drivers.cia402.monitor import fault_of, outside
from palpate.drivers.cia402.settings import ArmSettings
from palpate.drivers.device import ArmState, LatchingArm, Measured, clamped, held_back, require_angles
from palpate.drivers.errors import DriverError, StateError

_CONTROLWORD: Final = {
    ArmState.CONFIGURED: Controlword.DISABLE_VOLTAGE,
    ArmState.ENABLED: Controlword.ENABLE_OPERATION,
    ArmState.STOPPED: Controlword.QUICK_STOP,
}
_STATIONARY: Final = (DriveState.QUICK_STOP, DriveState.SWITCH_ON_DISABLED)


class Cia402Arm(LatchingArm):
    """An arm with CiA 402 drives. It does not open or close its bus, because other devices may share it."""

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
        """Describe the first problem with the drives, with or without power, or return "" if there is none."""
        for view, joint in zip(self._exchange.views, self.settings.joints, strict=False):
            if view.state in FAULTS:
                return f"drive {joint.node} is in fault; look its code up in the drive's manual (object 0x603F)"
            if view.position_rad is not None and outside(view.position_rad, joint):
                return f"drive {joint.node} is at {view.position_rad:.4f} rad, beyond the joint's limits"
        return ""

    def open(self) -> None:
        """Find and configure the drives, and wait for data from each, without switching on the power."""
        self._require("open()", ArmState.NEW)
        self._link.require_alive()
        self._exchange.listen()
        self._bring_up.identify()
        self._bring_up.prepare()
        self._state = ArmState.CONFIGURED

    def enable(self) -> None:
        """Switch on the drives where they are; without a cycle soon after, their watchdogs miss the heartbeat."""
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
        # The set-point is exactly the drives' current target, not a newer measurement, so that nothing moves.
        self.setpoint_rad = self._bring_up.held_rad
        self._stepped_ns = self._now_ns() - self.settings.period_ns
        self._state = ArmState.ENABLED

    def cycle(self, setpoint_rad: Sequence[float] | None = None, /) -> Measured:
        """Run one cycle: send set-points and the SYNC, then wait for the drives' replies.

        The set-point takes effect at this SYNC. The angles are measured at the same time, so they do not depend on
        it. Without a set-point, an enabled arm keeps its last one. If less than a period has passed since the last
        call, the maximum step is reduced in proportion.
        """
        self._require("cycle()", ArmState.CONFIGURED, ArmState.ENABLED, ArmState.STOPPED)
        now_ns, joints = self._now_ns(), self.settings.joints
        step_s = min((now_ns - self._stepped_ns) * 1e-9, self.settings.period_s)
        targets, enabled = self._exchange.hold(), self._state is ArmState.ENABLED
        if setpoint_rad is not None:
            self._require("a set-point", ArmState.ENABLED, ArmState.STOPPED)
            requested_rad = require_angles(setpoint_rad, len(joints))
            within_rad = clamped(
                requested_rad, [each.lower_rad for each in joints], [each.upper_rad for each in joints]
            )
            if enabled:
                most_rad = [joint.velocity_rad_per_s * step_s for joint in joints]
                self.setpoint_rad = held_back(within_rad, self.setpoint_rad, most_rad)
        self._stepped_ns = now_ns
        if enabled:
            targets = tuple(joint.counts(angle) for joint, angle in zip(joints, self.setpoint_rad, strict=True))
        with self._latching():
            self._exchange.run([_CONTROLWORD[self._state]] * len(targets), targets)
            self._judge(self._allowed())
        # Every drive has answered since ``prepare``, which precedes each cycle, so the held counts are all measured.
        measured = zip(joints, self._exchange.hold(), strict=True)
        return Measured(tuple(joint.angle_rad(counts) for joint, counts in measured), self._exchange.sync_ns)

    def stop(self) -> None:
        """Quick-stop every drive; an enabled arm holds its position under power until it is enabled again."""
        if self._state in (ArmState.NEW, ArmState.CLOSED):
            return
        if self._state is ArmState.ENABLED:
            self._state, self._cycles_since_stop = ArmState.STOPPED, 0
        self._exchange.broadcast(Controlword.QUICK_STOP)

    def disable(self) -> None:
        """Stop, wait until the joints are stationary, and switch off the power. The brakes then hold the joints."""
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
        """Clear a latched fault; the drives are configured again, as one may have restarted, but remain off."""
        self._require_fault()
        self._link.require_alive()
        self._bring_up.prepare()
        self._bring_up.walk(DriveState.SWITCH_ON_DISABLED, by_operator=True)
        self._state, self.fault = ArmState.CONFIGURED, None

    def close(self) -> None:
        """Stop, switch off the power if the bus still works, and end all traffic. Idempotent; never raises."""
        if self._state in (ArmState.NEW, ArmState.CLOSED):
            self._state = ArmState.CLOSED
            return
        self.stop()
        if self._state is not ArmState.CONFIGURED:
            with contextlib.suppress(DriverError):
                self._bring_up.come_to_rest()
        # A failed drive must not keep the others powered.
        with contextlib.suppress(DriverError):
            self._bring_up.shut_down()
        self._bring_up.hang_up()
        self._state = ArmState.CLOSED

    def _allowed(self) -> tuple[DriveState, ...] | None:
        if self._state is ArmState.ENABLED:
            return (DriveState.ENABLED,)
        if self._state is ArmState.STOPPED:
            self._cycles_since_stop += 1
            # A lost frame may delay the command to a drive, but only for a few cycles.
            heard = self._cycles_since_stop > self.settings.missed_cycles
            return _STATIONARY if heard else (*_STATIONARY, DriveState.ENABLED)
        return None

    def _judge(self, allowed: tuple[DriveState, ...] | None) -> None:
        error = fault_of(self._exchange.views, self.settings, self._now_ns(), allowed)
        if error is not None:
            raise error
