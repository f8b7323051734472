"""The clock of tests in virtual time: who comes when, and that nobody waits for real."""

import threading
import time

from tests.virtual_time import VirtualCondition, VirtualTime


def test_threads_take_turns_in_the_order_of_their_deadlines() -> None:
    clock, order = VirtualTime(), list[tuple[str, int]]()

    def guest() -> None:
        for _ in range(3):
            clock.sleep(0.3)
            order.append(("guest", clock.now_ns()))

    start_ns, began_s = clock.now_ns(), time.monotonic()
    threading.Thread(target=guest, name="a bus", daemon=True).start()
    for _ in range(2):
        clock.sleep(0.4)
        order.append(("host", clock.now_ns()))
    # The guest ends while the host sleeps on.
    clock.sleep(3600.0)
    due = [("guest", 3), ("host", 4), ("guest", 6), ("host", 8), ("guest", 9)]
    assert order == [(name, start_ns + tenths * 100_000_000) for name, tenths in due]
    assert clock.now_ns() == start_ns + 800_000_000 + 3600 * 10**9
    assert time.monotonic() - began_s < 60.0


class Ticker:
    def __init__(self) -> None:
        self.due_ns, self.ticks = 5_000_000, list[int]()

    def next_event_ns(self) -> int:
        return self.due_ns

    def step(self, now_ns: int) -> None:
        self.ticks.append(now_ns)
        self.due_ns += 5_000_000


def test_devices_live_while_everybody_sleeps_and_wake_whom_they_concern() -> None:
    clock, ticker = VirtualTime(), Ticker()
    clock.devices.append(ticker)
    assert clock.wait_for(lambda: len(ticker.ticks) == 3, 10**12)
    assert (clock.now_ns(), ticker.ticks) == (15_000_000, [5_000_000, 10_000_000, 15_000_000])
    assert not clock.wait_for(lambda: False, 17_000_000)
    assert clock.now_ns() == 17_000_000


def test_a_condition_is_waited_for_in_virtual_time() -> None:
    clock = VirtualTime()
    condition = VirtualCondition(clock)

    def guest() -> None:
        clock.sleep(0.2)
        with condition:
            condition.notify_all()

    start_ns = clock.now_ns()
    threading.Thread(target=guest, name="a bus", daemon=True).start()
    with condition:
        condition.wait(10.0)
    assert clock.now_ns() == start_ns + 200_000_000
    condition.wait(0.1)
    assert clock.now_ns() == start_ns + 300_000_000
