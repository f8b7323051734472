"""An arm on a field bus as the two arm ports: a thread cycles the bus, the ports read and write its newest values."""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from typing_extensions import override

from palpate.adapters.hardware.errors import lately, told, translated, translating
from palpate.adapters.hardware.following import Following
from palpate.core.errors import CommandError, DeviceError
from palpate.core.ports import (
    CONTROL_RATE_HZ,
    AppliedCommand,
    ArmCommand,
    Clock,
    CommandReason,
    JointCommand,
    JointEncoder,
    JointSample,
    JointVector,
    Life,
    ManagedDevice,
    Validity,
)
from palpate.drivers.device import ArmDriver
from palpate.drivers.errors import DriverError, GarbledError

_NS: Final = 1_000_000_000
_PATIENCE_NS: Final = 3 * _NS
"""Longest wait for the thread to bring a first sample."""
_STOP_NS: Final = 3 * _NS // 2
"""Longest wait for whoever tells the driver to stop. A cycle takes milliseconds, a stop that is watched 1 s at most."""
_POLL_NS: Final = 1_000_000
"""How often such a wait looks up."""
_DOZE_NS: Final = 2_500_000
"""How often the thread looks between two cycles whether the arm is to be stopped."""


@dataclass(frozen=True, slots=True)
class OpenArm:
    """A driver on a bus that is open.

    Attributes:
        close: Closes the port or the bus; called after the driver's own ``close``.
    """

    driver: ArmDriver
    close: Callable[[], None]


class BusArm(ManagedDevice, JointEncoder, ArmCommand):
    """Encoders and servos of an arm on a bus, at a whole fraction of the control rate; the newest command wins.

    Attributes:
        listens: Only angles are read: the arm gets neither power nor commands. Set it before :meth:`activate`.

    Args:
        judge: Called when the arm is open, before it gets power; returns lines for the person, or refuses the arm.
        tell: Takes those lines, and the driver's notes.
        later_ns: By so much later than before angles may follow the set-points; 0 asks nothing of how they follow.
    """

    def __init__(
        self,
        name: str,
        open_bus: Callable[[], OpenArm],
        clock: Clock,
        *,
        joints: int,
        divider: int,
        max_age_ns: int,
        later_ns: int = 0,
        hurry: Callable[[], object] | None = None,
        judge: Callable[[ArmDriver], Sequence[str]] = lambda driver: (),
        tell: Callable[[str], object] = str,
    ) -> None:
        super().__init__(name)
        self.listens, self._judge, self._tell = False, judge, tell
        self._hurry, self._later_ns = hurry, later_ns
        self._open_bus, self._clock, self._joints = open_bus, clock, joints
        self._opened: OpenArm | None = None
        self._divider, self._max_age_ns = divider, max_age_ns
        self._thread: threading.Thread | None = None
        # One writer each, and every value is replaced whole: no lock is needed, and a signal handler may call stop().
        self._newest: JointVector | None = None
        self._sample: JointSample | None = None
        self._cycles = 0
        self._end = self._stop_wanted = self._stopped = False
        self._stopping, self._stopper = threading.Lock(), 0

    @property
    def rate_Hz(self) -> float:
        """Rate of its bus cycles."""
        return CONTROL_RATE_HZ / self._divider

    def diagnostics(self) -> dict[str, str]:
        """Return what the driver reports of itself; empty before ``configure``."""
        return {} if self._opened is None else self._opened.driver.diagnostics(self._clock.now_ns())

    @property
    def _driver(self) -> ArmDriver:
        if self._opened is None:
            raise DeviceError(self.name, "is not open")
        return self._opened.driver

    def account(self) -> str:
        """What the bus gave of late besides good answers, or instead of them; empty where nothing was wrong."""
        opened, sample, now_ns = self._opened, self._sample, self._clock.now_ns()
        if opened is None:
            return ""
        odd = opened.driver.oddities(now_ns)
        if sample is None or now_ns - sample.source_time_ns <= self._max_age_ns:
            return lately(odd)
        silent_ms = (now_ns - sample.source_time_ns) * 1e-6
        return f"no bus cycle has brought angles for {silent_ms:.0f} ms; {odd or 'one is waiting for an answer'}"

    @override
    def read(self) -> JointSample:
        if self._life is not Life.ACTIVE:
            self._require_active("read()")
        sample = self._sample
        if sample is None:
            raise DeviceError(self.name, "has not delivered a sample yet")
        if self._clock.now_ns() - sample.source_time_ns > self._max_age_ns:
            old = (sample.source_time_ns, sample.receive_time_ns, sample.sequence)
            return JointSample(sample.position_rad, *old, Validity.STALE)
        return sample

    @override
    def send(self, command: JointCommand) -> AppliedCommand:
        if self._life is not Life.ACTIVE:
            self._require_active("send()")
        asked = command.position_rad
        if len(asked) != self._joints:
            raise CommandError(f"the arm has {self._joints} joints, the command has another number", len(asked))
        if self._stop_wanted or self.listens:
            return AppliedCommand(self._where(), CommandReason.STOPPED)
        with translating(self.name):
            applied = self._driver.preview(asked)
        self._newest = asked
        return AppliedCommand(applied.position_rad, CommandReason[applied.reason.name])

    def stop(self) -> None:
        """Stop the arm; returns when the arm has been told, or it has taken too long."""
        self._stop_wanted = True
        thread = self._thread
        if thread is not None and thread.is_alive():
            # The driver is that thread's.
            self._wait(lambda: self._stopped or not thread.is_alive(), _STOP_NS)
        else:
            self._stop_driver()

    def _stop_driver(self) -> None:
        """One thread tells the driver, once until the arm is activated again; another one waits until that is done."""
        opened = self._opened
        if opened is None or self._stopped:
            return
        if not self._stopping.acquire(blocking=False):
            # A signal handler may have interrupted the very one that is at it.
            if self._stopper != threading.get_ident():
                self._wait(lambda: not self._stopping.locked(), _STOP_NS)
            return
        self._stopper = threading.get_ident()
        try:
            if not self._stopped:
                opened.driver.stop()
                self._stopped = True
        finally:
            self._stopper = 0
            self._stopping.release()

    def _where(self) -> JointVector:
        return () if self._sample is None else self._sample.position_rad

    def _run(self) -> None:
        """The thread: cycle after cycle at absolute times, until told to end or something fails."""
        if self._hurry is not None:
            self._hurry()
        start_ns, slot = self._clock.now_ns(), 0
        driver, following = self._driver, Following(self._later_ns)
        held: JointVector | None = None
        try:
            while not self._end:
                self._sleep_until(start_ns + slot * _NS * self._divider // CONTROL_RATE_HZ)
                now_ns = self._clock.now_ns()
                if self._stop_wanted:
                    self._stop_driver()
                found = driver.cycle(None if self._stopped else self._newest)
                if self._sample is None or found.time_ns > self._sample.source_time_ns:
                    # What was measured before is no news; it grows old.
                    self._cycles += 1
                    self._sample = JointSample(found.position_rad, found.time_ns, self._clock.now_ns(), self._cycles)
                held = held if found.applied is None else found.applied.position_rad
                if self._later_ns and held is not None and not self._stopped:
                    self._require_following(following.note(now_ns, held, found.time_ns, found.position_rad))
                slot = max(slot + 1, (now_ns - start_ns) * CONTROL_RATE_HZ // (_NS * self._divider) + 1)
        except DriverError as error:
            cause, odd = told(error, self.name), lately(driver.oddities(self._clock.now_ns()))
            self._latch(f"{cause}; {odd}" if odd else cause)
            self._stop_driver()
        except Exception as error:
            # Whatever it was: without its cycles the arm must not go on.
            self._latch(f"the bus thread failed: {error!r}")
            self._stop_driver()

    def _require_following(self, problem: str | None) -> None:
        if problem is not None:
            remedy = "see what stands between it and this computer, or raise [arm] patience where that is its way"
            raise GarbledError(self.name, problem, remedy)

    def _sleep_until(self, deadline_ns: int) -> None:
        """Sleep to the next cycle; a stop is not kept waiting for it."""
        while (now_ns := self._clock.now_ns()) < deadline_ns and not self._end:
            if self._stop_wanted and not self._stopped:
                self._stop_driver()
            self._clock.sleep_until(min(deadline_ns, now_ns + _DOZE_NS))

    def _end_thread(self) -> bool:
        """End the thread; False where it does not end, so that the driver is still its."""
        thread = self._thread
        if thread is not None:
            # Its last cycle sends nothing that came just before.
            self._newest, self._end = None, True
            self._wait(lambda: not thread.is_alive(), _STOP_NS)
            if thread.is_alive():
                return False
            self._thread = None
        return True

    def _take_back(self) -> ArmDriver:
        """The driver, once the thread has ended."""
        if not self._end_thread():
            self._latch("the bus thread does not end")
            raise DeviceError(self.name, "the bus thread does not end")
        return self._driver

    def _wait(self, done: Callable[[], bool], patience_ns: int) -> None:
        """Wait for another thread, on the run's clock; not for ever."""
        deadline_ns = self._clock.now_ns() + patience_ns
        while not done() and self._clock.now_ns() < deadline_ns:
            self._clock.sleep_until(self._clock.now_ns() + _POLL_NS)

    def _on_configure(self) -> None:
        try:
            with translating(self.name):
                self._opened = self._open_bus()
                driver = self._opened.driver
                driver.open()
            for note in (*driver.notes, *self._judge(driver)):
                self._tell(f"{self.name}: {note}")
        except BaseException:
            self._release(owned=True)
            raise

    def _release(self, *, owned: bool) -> None:
        opened, self._opened = self._opened, None
        if opened is not None:
            if owned:
                opened.driver.close()
            # Under a thread that does not end this is what is left: its next word on the bus fails.
            opened.close()

    def _on_activate(self) -> None:
        self._stopped = False
        if not self.listens:
            self._enable()
        self._newest = self._sample = None
        self._end = self._stop_wanted = self._stopped = False
        thread = threading.Thread(target=self._run, name=f"{self.name} bus", daemon=True)
        self._thread = thread
        thread.start()
        self._wait(lambda: self._sample is not None or not thread.is_alive(), _PATIENCE_NS)
        if self._sample is None:
            raise DeviceError(self.name, self.fault or "delivers no joint angles")

    def _enable(self) -> None:
        """What has failed while nothing cycled the bus is found now, and is a fault as any other."""
        driver = self._driver
        try:
            driver.enable()
        except DriverError as error:
            if driver.is_faulted:
                self._latch(told(error, self.name))
            raise translated(error, self.name) from error

    def _on_deactivate(self) -> None:
        driver = self._take_back()
        self._stop_driver()
        with translating(self.name):
            driver.disable()

    def _on_acknowledge(self) -> None:
        driver = self._take_back()
        with translating(self.name):
            driver.acknowledge()

    def _on_close(self) -> None:
        owned = self._end_thread()
        if owned:
            self._stop_driver()
        self._release(owned=owned)
