"""Slow operations on an arm: finding and configuring the drives and changing their states."""

from collections.abc import Callable, Sequence
from typing import Final

from palpate.drivers.cia402 import codec
from palpate.drivers.cia402.drive import arm_watchdog, identify, set_up
from palpate.drivers.cia402.exchange import CyclicExchange
from palpate.drivers.cia402.link import CanopenLink
from palpate.drivers.cia402.monitor import AxisView, fault_of
from palpate.drivers.cia402.settings import ArmSettings
from palpate.drivers.errors import DeviceFaultError, SilentError

_STILL_CYCLES, _STILL_COUNTS = 3, 2
"""A joint is stationary after this number of consecutive cycles with at most this motion per cycle, in counts."""
_NS: Final = 1e-9


class BringUp:
    """Operations on the drives that take longer than a cycle."""

    def __init__(
        self,
        link: CanopenLink,
        settings: ArmSettings,
        exchange: CyclicExchange,
        now_ns: Callable[[], int],
        sleep: Callable[[float], None],
    ) -> None:
        self._settings, self._exchange = settings, exchange
        self._now_ns, self._sleep = now_ns, sleep
        self._link = link
        self._objects = [link.objects(joint.node, settings.sdo_timeout_s) for joint in settings.joints]
        self.identities: tuple[str, ...] = ()
        self.notes: tuple[str, ...] = ()

    @property
    def held_rad(self) -> tuple[float, ...]:
        """Last holding position commanded to the drives."""
        targets = zip(self._settings.joints, self._exchange.targets, strict=True)
        return tuple(joint.angle_rad(counts) for joint, counts in targets)

    def identify(self) -> None:
        """Read the name and serial number of every drive."""
        self.identities = tuple(identify(objects) for objects in self._objects)

    def prepare(self) -> None:
        """Configure all drives, start their process data, and wait for data from each drive."""
        self._exchange.heartbeat_on = False
        for objects in self._objects:
            # A drive may still have power after an earlier program died.
            objects.write(0x6040, 0, codec.Controlword.QUICK_STOP, 2)
        self._exchange.command_nmt(codec.NMT_PRE_OPERATIONAL)
        pairs = zip(self._objects, self._settings.joints, strict=True)
        self.notes = tuple(note for objects, joint in pairs for note in set_up(objects, joint, self._settings))
        self._exchange.start_over()
        self._exchange.command_nmt(codec.NMT_START)
        deadline_ns = self._deadline_ns()
        # Heartbeats from before the start would look as if drives had left the operational state.
        while not self._exchange.all_operational():
            if self._now_ns() > deadline_ns:
                raise SilentError("arm", "not every drive became operational", "check power and node numbers")
            self._sleep(self._settings.period_s)
        self.look()

    def look(self) -> tuple[AxisView, ...]:
        """Run cycles without power until every drive has answered."""
        deadline_ns = self._deadline_ns()
        while True:
            begin_ns = self._now_ns()
            views = self._run([codec.Controlword.DISABLE_VOLTAGE] * len(self._objects))
            if all(view.missed_in_a_row == 0 for view in views):
                return views
            if self._now_ns() > deadline_ns:
                silent = [view.box.node for view in views if view.missed_in_a_row > 0]
                raise SilentError("arm", f"drives {silent} send no process data", "check them and the bus load")
            self._pause(begin_ns)

    def walk(self, goal: codec.DriveState, *, by_operator: bool = False) -> None:
        """Bring all drives to the state ``goal`` without motion."""
        deadline_ns = self._deadline_ns()
        allowed = [state for state in codec.DriveState if by_operator or state not in codec.FAULTS]
        last: Sequence[codec.Controlword] = [codec.Controlword.DISABLE_VOLTAGE] * len(self._objects)
        while True:
            begin_ns = self._now_ns()
            views = self._exchange.views
            last = [self._word(view, goal, word, by_operator) for view, word in zip(views, last, strict=True)]
            views = self._run(last)
            # Only a powered drive can deviate; without power, a person may be moving the joints by hand.
            powered = goal is codec.DriveState.ENABLED
            error = fault_of(views, self._settings, self._now_ns(), allowed if powered else None)
            if error is not None:
                raise error
            if all(view.state is goal and view.missed_in_a_row == 0 for view in views):
                return
            if begin_ns > deadline_ns:
                states = ", ".join(f"{v.box.node}: {v.state.value if v.state else v.statusword}" for v in views)
                local = [
                    v.box.node for v in views if v.statusword is not None and not v.statusword & codec.Status.REMOTE
                ]
                states += f"; not under remote control: {local}" if local else ""
                raise DeviceFaultError("arm", f"not every drive reached '{goal.value}' ({states})", "see the drives")
            self._pause(begin_ns)

    def come_to_rest(self) -> None:
        """Continue the quick stop until all responding drives are stationary."""
        slowest_s = max(j.velocity_rad_per_s for j in self._settings.joints) / self._settings.quick_stop_rad_per_s2
        deadline_ns = self._deadline_ns() + int(slowest_s / _NS)
        still = 0
        while still < _STILL_CYCLES:
            begin_ns = self._now_ns()
            if begin_ns > deadline_ns:
                raise SilentError("arm", "the joints do not come to rest", "use the emergency stop")
            views = self._run([codec.Controlword.QUICK_STOP] * len(self._objects))
            heard = [i for i, view in enumerate(views) if view.missed_in_a_row <= self._settings.missed_cycles]
            if not heard:
                # The drives have received the stop command; waiting longer has no effect.
                raise SilentError("arm", "no drive answers a quick stop", "use the emergency stop")
            is_still = all(views[i].missed_in_a_row == 0 and abs(views[i].moved_counts) <= _STILL_COUNTS for i in heard)
            still = still + 1 if is_still else 0
            self._pause(begin_ns)

    def watchdogs(self, *, on: bool) -> None:
        """Start the host's heartbeat for the drives, or end it without causing an alarm."""
        for objects in self._objects:
            arm_watchdog(objects, self._settings, on=on)
        self._exchange.heartbeat_on = on

    def shut_down(self) -> None:
        """Switch off the power and end all communication."""
        for _ in range(self._settings.missed_cycles):
            begin_ns = self._now_ns()
            self._run([codec.Controlword.DISABLE_VOLTAGE] * len(self._objects))
            self._pause(begin_ns)
        self.watchdogs(on=False)
        self._exchange.command_nmt(codec.NMT_PRE_OPERATIONAL)

    def hang_up(self) -> None:
        """Stop listening to the nodes."""
        self._exchange.unsubscribe()
        for objects in self._objects:
            self._link.unsubscribe(codec.SDO_ANSWER + objects.node)

    def _run(self, words: Sequence[codec.Controlword]) -> tuple[AxisView, ...]:
        return self._exchange.run(words, self._exchange.hold())

    def _deadline_ns(self) -> int:
        return self._now_ns() + int(self._settings.transition_timeout_s / _NS)

    def _pause(self, begin_ns: int) -> None:
        self._sleep(max(0, self._settings.period_ns - (self._now_ns() - begin_ns)) * _NS)

    @staticmethod
    def _word(view: AxisView, goal: codec.DriveState, last: codec.Controlword, by_operator: bool) -> codec.Controlword:
        word = codec.command_towards(view.state, goal, by_operator=by_operator)
        # Fault-reset acts on a rising edge, so its bit must be cleared before another attempt.
        is_again = word is last is codec.Controlword.FAULT_RESET
        return codec.Controlword.DISABLE_VOLTAGE if is_again else word
