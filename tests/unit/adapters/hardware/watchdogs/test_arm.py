"""Arms that stop when commands stop coming, and arms that stay at rest."""

import signal
import threading
import time
from contextlib import suppress

import pytest

from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.watchdogs import GuardedArm, WatchdogTrip, WatchedArm
from palpate.adapters.hardware.watchdogs.arm import AgeWatch
from palpate.adapters.hardware.watchdogs.trip import Latch
from palpate.core.errors import ConfigurationError, DeviceError, FaultLatchedError, LifecycleError
from palpate.core.ports import CommandReason
from palpate.core.ports.contracts import TICK_NS, FakeClock
from tests.unit.adapters.hardware.watchdogs.bench import HERE, active_arm, nothing_left_behind, wait_for

LIMIT_NS = 3000 * TICK_NS
"""Virtual time; the thread looks as it starts, perhaps late, and not again before as much real time has gone by."""
SOON_NS = 3 * TICK_NS
"""Here it is the thread that is tested."""


def test_commands_that_keep_coming_keep_it_going() -> None:
    clock = FakeClock()
    arm = active_arm(clock)
    watched = WatchedArm(arm, clock, LIMIT_NS)
    for _ in range(20):
        assert watched.send(HERE).reason is CommandReason.AS_ASKED
        clock.advance(3000)
    assert (arm.stops, watched.tripped) == ([], None)
    watched.close()


def test_a_late_command_finds_the_arm_stopped_until_it_is_activated_again() -> None:
    clock, told = FakeClock(), list[WatchdogTrip]()
    arm = active_arm(clock)
    watched = WatchedArm(arm, clock, LIMIT_NS, tell=told.append)
    watched.send(HERE)
    clock.advance(4000)
    for _ in range(3):
        assert watched.send(HERE).reason is CommandReason.STOPPED
    assert watched.tripped == told[0]
    assert len(told) == 1
    assert told[0].source == "command age"
    assert "no command for 28571.4 ms, 21428.6 ms are allowed" in told[0].text
    watched.deactivate()
    watched.activate()
    assert watched.tripped is None
    assert watched.send(HERE).reason is CommandReason.AS_ASKED
    watched.close()


def test_the_thread_stops_the_arm_of_a_dead_loop() -> None:
    told: list[WatchdogTrip] = []
    with nothing_left_behind():
        clock = MonotonicClock()
        arm = active_arm(clock)
        watched = WatchedArm(arm, clock, 20_000_000, tell=told.append)
        watched.send(HERE)
        wait_for(lambda: told)
        assert set(arm.stops) == {"command watchdog"}
        assert watched.send(HERE).reason is CommandReason.STOPPED
        watched.close()
    assert len(told) == 1


@pytest.mark.parametrize("rest", ["stop", "deactivate", "close"])
def test_nobody_commands_an_arm_at_rest(rest: str) -> None:
    clock = FakeClock()
    arm = active_arm(clock)
    watched = WatchedArm(arm, clock, LIMIT_NS)
    watched.send(HERE)
    getattr(watched, rest)()
    clock.advance(10_000)
    with suppress(LifecycleError):
        watched.send(HERE)
    assert watched.tripped is None
    watched.close()


def test_before_the_first_command_nothing_is_watched() -> None:
    clock = FakeClock()
    watched = WatchedArm(active_arm(clock), clock, LIMIT_NS)
    clock.advance(10_000)
    assert watched.send(HERE).reason is CommandReason.AS_ASKED
    watched.close()


def test_an_arm_activated_underneath_is_watched_again() -> None:
    clock = FakeClock()
    arm = active_arm(clock)
    watched = WatchedArm(arm, clock, LIMIT_NS)
    for _ in range(2):
        assert watched.send(HERE).reason is CommandReason.AS_ASKED
        assert watched.tripped is None
        clock.advance(4000)
        watched.send(HERE)
        assert watched.tripped is not None
        arm.deactivate()
        arm.activate()
    watched.close()


def test_an_arm_that_is_gone_cannot_kill_the_watch() -> None:
    clock, told = FakeClock(), list[WatchdogTrip]()
    arm = active_arm(clock)
    watched = WatchedArm(arm, clock, LIMIT_NS, tell=told.append)
    watched.send(HERE)
    arm.gone = True
    clock.advance(4000)
    with suppress(DeviceError):
        watched.send(HERE)
    assert "stop() failed: DeviceError" in told[0].text
    for _ in range(2):
        watched.stop()
    watched.close()


def test_a_listener_that_fails_cannot_kill_the_watch() -> None:
    def tell(trip: WatchdogTrip) -> None:
        raise RuntimeError("no room on the disk")

    clock = FakeClock()
    watched = WatchedArm(active_arm(clock), clock, SOON_NS, tell=tell)
    for _ in range(2):
        watched.send(HERE)
        clock.advance(4000)
        wait_for(lambda: watched.tripped)
        watched.deactivate()
        watched.activate()
    watched.close()


def test_stop_from_a_signal_handler_in_the_middle_of_anything() -> None:
    clock = MonotonicClock()
    arm = active_arm(clock)
    watched = WatchedArm(arm, clock, 3600 * 10**9)
    before = signal.signal(signal.SIGALRM, lambda *_: watched.stop())
    try:
        # As fast as it can be: sooner or later it comes in the middle of a send.
        signal.setitimer(signal.ITIMER_REAL, 2e-4, 2e-4)
        for _ in range(300):
            arm.deactivate()
            arm.activate()
            watched.send(HERE)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        watched.stop()
        assert watched.send(HERE).reason is CommandReason.STOPPED
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
        watched.close()


def test_a_limit_must_be_positive() -> None:
    clock = FakeClock()
    with pytest.raises(ConfigurationError, match="more than 0"):
        WatchedArm(active_arm(clock), clock, 0)


def test_it_may_be_closed_by_whom_it_tells() -> None:
    clock = FakeClock()
    closed = threading.Event()

    def tell(trip: WatchdogTrip) -> None:
        watched.close()
        closed.set()

    watched = WatchedArm(active_arm(clock), clock, SOON_NS, tell=tell)
    watched.send(HERE)
    clock.advance(10)
    wait_for(closed.is_set)
    watched.close()


def test_whoever_looks_meanwhile_waits_until_the_arm_is_at_rest() -> None:
    clock, asked, looked = FakeClock(), threading.Event(), list[bool]()
    other = threading.Thread(target=lambda: (asked.set(), looked.append(watch.check())))

    def on_old(age_ns: int) -> None:
        ages.append(age_ns)
        other.start()
        asked.wait()
        time.sleep(0.02)
        assert looked == []

    ages: list[int] = []
    watch = AgeWatch("watch", clock, LIMIT_NS, on_old)
    watch.feed()
    clock.advance(4000)
    watch.check()
    other.join()
    assert ages == [4000 * TICK_NS]
    assert looked == [False]
    watch.end()


def test_an_ended_watch_cannot_be_fed() -> None:
    watch = AgeWatch("watch", FakeClock(), LIMIT_NS, lambda age_ns: None)
    watch.end()
    watch.end()
    with pytest.raises(LifecycleError, match="closed"):
        watch.feed()


# --- Arms that stay at rest.


def test_a_guarded_arm_neither_activates_nor_moves_until_acknowledged() -> None:
    clock = FakeClock()
    arm = active_arm(clock)
    latch = Latch()
    guarded = GuardedArm(arm, [latch])
    assert guarded.send(HERE).reason is CommandReason.AS_ASKED
    latch.trip(WatchdogTrip(0, "loop", "no tick for 1 s"))
    arm.deactivate()
    with pytest.raises(FaultLatchedError, match="loop: no tick for"):
        guarded.activate()
    # Whoever goes behind its back does not get far.
    arm.activate()
    assert guarded.send(HERE).reason is CommandReason.STOPPED
    latch.clear()
    guarded.deactivate()
    guarded.activate()
    assert guarded.send(HERE).reason is CommandReason.AS_ASKED
    guarded.stop()
    assert guarded.send(HERE).reason is CommandReason.STOPPED
