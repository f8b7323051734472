"""Each section is charged its own time, late ticks are told with their causes, and memory does not grow."""

import json

import pytest

from palpate.adapters.hardware.real_time import (
    BUSY,
    LATE,
    Cause,
    LateTick,
    Limits,
    SlowCore,
    TickSection,
    plain,
    table,
)  # fmt: skip
from palpate.core.control_loop import LoopObserver, next_slot, tick_time_ns
from palpate.core.errors import DeviceError
from palpate.core.ports.values import CONTROL_RATE_HZ
from tests.unit.adapters.hardware.real_time.bench import MS, Bench, FakeAccount, work

PERIOD_NS = 10**9 // CONTROL_RATE_HZ


def test_sections_are_charged_their_own_time_and_the_rest_is_the_rest() -> None:
    bench = Bench()
    bench.sensor.took_ns, bench.encoder.took_ns, bench.core_ns = 300, 200, 1100
    bench.trial(500)
    spread = bench.stopwatch.spread
    assert (spread(TickSection.FORCE).count, spread(TickSection.FORCE).mean_ns) == (500, 300)
    assert (spread(TickSection.JOINTS).mean_ns, spread(TickSection.CONTROL).mean_ns) == (200, 1100)
    assert (spread(BUSY).count, spread(BUSY).max_ns, spread(BUSY).mean_ns) == (500, 1600, 1600)
    assert (spread(LATE).count, spread(LATE).max_ns) == (500, 0)
    assert spread(TickSection.DECIDE).count == 0


def test_trials_are_apart_and_the_last_tick_of_each_counts() -> None:
    bench = Bench()
    for _ in range(3):
        bench.arm.deactivate()
        bench.arm.activate()
        bench.trial(10)
        bench.clock.sleep_until(bench.clock.now_ns() + 3600 * 10**9)
    assert bench.stopwatch.ticks == bench.stopwatch.spread(BUSY).count == 30
    assert bench.stopwatch.skipped_slots == 0
    assert bench.stopwatch.spread(BUSY).max_ns == 0


def test_bringing_the_arm_to_rest_is_no_part_of_the_last_tick() -> None:
    bench = Bench()
    bench.core_ns, bench.arm.rest_ns = 1000, 28 * MS
    bench.trial(3)
    assert bench.stopwatch.spread(BUSY).max_ns == 1000
    assert bench.stopwatch.ticks == 3


def test_slots_that_go_by_are_counted() -> None:
    bench = Bench()
    bench.core_ns = 3 * PERIOD_NS
    bench.trial(5)
    expected, slot, now, start = 0, 0, 5, 5
    for tick in range(5):
        now = max(now, tick_time_ns(start, slot))
        following = next_slot(start, slot, now)
        if tick < 4:
            expected += following - slot - 1
        now, slot = now + bench.core_ns, following
    assert bench.stopwatch.skipped_slots == expected > 0


def test_a_tick_that_is_woken_late_is_the_system_s_fault() -> None:
    bench = Bench(Limits(warn_late_ns=MS), FakeAccount())
    bench.trial(4, lambda tick: setattr(bench.clock, "late_ns", 2 * MS if tick == 2 else 0))
    (late,) = bench.told
    assert isinstance(late, LateTick)
    assert (late.late_ns, late.attribution.cause) == (2 * MS, Cause.WOKEN_LATE)
    assert bench.stopwatch.late_ticks[Cause.WOKEN_LATE] == 1
    assert list(bench.stopwatch.newest_late) == [late]


def test_a_loop_that_was_woken_and_had_to_wait_again_waited_for_the_program() -> None:
    bench = Bench(Limits(warn_late_ns=MS), FakeAccount(turns_each=2))
    bench.clock.late_ns = 2 * MS
    bench.trial(3)
    assert {late.attribution.cause for late in bench.told if isinstance(late, LateTick)} == {Cause.WAITED}


def test_a_tick_without_a_processor_is_the_system_s_fault() -> None:
    late = late_in_sleep(delay_ns=2 * MS - 100)
    assert late.attribution.cause is Cause.NO_CPU
    shares = late.attribution.shares_ns
    assert (shares[Cause.NO_CPU], shares[Cause.WOKEN_LATE]) == (2 * MS - 100, 100)


@pytest.mark.parametrize(
    ("clock_works", "charged_ns", "cause"),
    [
        (False, PERIOD_NS + 2 * MS, Cause.WOKEN_LATE),
        (True, PERIOD_NS + 2 * MS, Cause.OWN_WORK),
        # It had the time until the deadline for that.
        (True, 2 * MS, Cause.WOKEN_LATE),
    ],
)
def test_what_a_sleeper_is_charged_is_its_own_work_only_where_the_clock_works(
    clock_works: bool, charged_ns: int, cause: Cause
) -> None:
    assert late_in_sleep(run_ns=charged_ns, clock_works=clock_works).attribution.cause is cause


def late_in_sleep(*, delay_ns: int = 0, run_ns: int = 0, clock_works: bool = False) -> LateTick:
    """The second tick is woken 2 ms late; this is what the kernel's account says of the sleep."""
    account = FakeAccount()
    bench = Bench(Limits(warn_late_ns=MS), account, clock_works=clock_works)
    sleep = bench.clock.sleep_until

    def charged(deadline_ns: int) -> None:
        if bench.stopwatch.ticks == 1 and not account.delay_ns + account.run_ns:
            account.delay_ns += delay_ns
            account.run_ns += run_ns
        sleep(deadline_ns)

    bench.clock.sleep_until = charged  # type: ignore[method-assign]
    bench.trial(3, lambda tick: setattr(bench.clock, "late_ns", 2 * MS if tick == 0 else 0))
    (late,) = bench.told
    assert isinstance(late, LateTick)
    assert late.late_ns == 2 * MS
    return late


def late_after_working_too_long(account: FakeAccount) -> LateTick:
    bench = Bench(Limits(warn_late_ns=MS), account)
    bench.core_ns = PERIOD_NS + 2 * MS
    bench.trial(2)
    (late,) = bench.told
    assert isinstance(late, LateTick)
    return late


def test_a_tick_after_one_that_took_too_long_is_our_own_fault() -> None:
    late = late_after_working_too_long(FakeAccount(run_ns_each=PERIOD_NS + 2 * MS))
    assert late.attribution.cause is Cause.OWN_WORK
    assert late.attribution.shares_ns[Cause.OWN_WORK] == late.late_ns
    assert "own work" in str(late)


@pytest.mark.parametrize("slow", ["read force", "decide", "control", "record"])
def test_of_our_own_work_is_told_what_took_longest(slow: str) -> None:
    bench = Bench(Limits(warn_late_ns=MS), FakeAccount(run_ns_each=PERIOD_NS + 2 * MS))
    bench.core_ns = 2 * MS

    def long(*_: object) -> None:
        work(bench.clock, PERIOD_NS)

    class SlowRecorder(LoopObserver):
        def sent(self, *_: object) -> None:
            if slow == "record":
                long()

    def on_tick(tick: int) -> None:
        if slow == "decide":
            bench.stopwatch.sensed(None)
            long()
            bench.stopwatch.chosen()
        if slow == "control":
            long()

    if slow == "read force":
        bench.sensor.took_ns = PERIOD_NS
    bench.observers = (bench.stopwatch, SlowRecorder(), bench.stopwatch.recording)
    bench.trial(2, on_tick)
    (late,) = bench.told
    assert isinstance(late, LateTick)
    assert f"own work: {slow} (" in str(late)
    assert bench.stopwatch.blamed == {f"own work: {slow}": 1}
    assert f"ticks later than 1 ms: 1 (1 own work: {slow})" in table(bench.stopwatch)


def test_what_made_a_tick_late_is_told_of_the_late_one_after_it() -> None:
    bench = Bench(Limits(warn_late_ns=MS), FakeAccount(run_ns_each=2 * PERIOD_NS))

    def on_tick(tick: int) -> None:
        work(bench.clock, 2 * PERIOD_NS - 2 * MS if tick == 0 else 0)
        bench.sensor.took_ns = PERIOD_NS - MS

    bench.trial(3, on_tick)
    assert [late.longest for late in bench.told if isinstance(late, LateTick)] == ["control", "control"]


@pytest.mark.parametrize(("turns", "cause"), [(1, Cause.TAKEN), (2, Cause.WAITED)])
def test_the_kernel_does_not_charge_for_a_processor_that_was_taken_away_nor_for_waiting(
    turns: int, cause: Cause
) -> None:
    late = late_after_working_too_long(FakeAccount(run_ns_each=PERIOD_NS + MS // 2, turns_each=turns))
    assert late.attribution.cause is cause
    shares = late.attribution.shares_ns
    assert (shares[Cause.OWN_WORK], shares[cause]) == (late.late_ns - 3 * MS // 2, 3 * MS // 2)


@pytest.mark.parametrize("clock_works", [False, True])
def test_a_tick_that_is_late_after_a_late_one_has_the_cause_of_that_one(clock_works: bool) -> None:
    account = FakeAccount(run_ns_each=2 * MS)
    bench = Bench(Limits(warn_late_ns=MS), account, clock_works=clock_works)
    late_ns = [2 * PERIOD_NS - MS // 2, 3 * MS // 2 if clock_works else 0, 0]

    def on_tick(tick: int) -> None:
        bench.clock.late_ns = late_ns[tick]
        if tick == 1 and not clock_works:
            work(bench.clock, 2 * MS)

    bench.trial(3, on_tick)
    first, second = bench.told
    assert isinstance(first, LateTick)
    assert isinstance(second, LateTick)
    assert first.attribution.cause is second.attribution.cause is Cause.WOKEN_LATE
    assert second.late_ns == pytest.approx(3 * MS // 2, abs=10)


def test_without_an_account_the_cause_is_not_known() -> None:
    bench = Bench(Limits(warn_late_ns=MS))
    bench.clock.late_ns = 2 * MS
    bench.trial(4)
    assert bench.stopwatch.late_ticks[Cause.UNKNOWN] == 4


def test_a_tick_later_than_allowed_ends_the_trial_with_the_arm_stopped() -> None:
    bench = Bench(Limits(stop_late_ns=3 * MS))
    bench.clock.late_ns = 4 * MS
    with pytest.raises(DeviceError, match=r"4\.00 ms late.*3 ms are allowed"):
        bench.trial(4)
    assert bench.told == []
    assert bench.stopwatch.ticks == 1


def test_a_core_that_thinks_for_too_long_is_told() -> None:
    bench = Bench(Limits(warn_core_ns=MS))
    bench.sensor.took_ns, bench.core_ns = 2 * MS, MS // 2
    bench.trial(3)
    assert bench.told == []
    bench.core_ns = 2 * MS
    bench.trial(2)
    assert bench.told == [SlowCore(3, 2 * MS), SlowCore(4, 2 * MS)]
    assert bench.stopwatch.slow_cores == 2


def test_the_warm_up_does_not_count() -> None:
    bench = Bench(Limits(warn_late_ns=MS, stop_late_ns=MS, warn_core_ns=MS, warm_up_ticks=5))
    bench.clock.late_ns = bench.core_ns = 2 * MS
    bench.trial(5)
    assert bench.told == []
    assert bench.stopwatch.spread(BUSY).count == 0
    with pytest.raises(DeviceError):
        bench.trial(1)


def test_what_is_kept_does_not_grow() -> None:
    bench = Bench(Limits(warn_late_ns=MS))
    bench.clock.late_ns = 2 * MS
    bench.trial(1000)
    assert sum(bench.stopwatch.late_ticks.values()) == 1000
    assert len(bench.stopwatch.newest_late) == 256
    assert bench.stopwatch.newest_late[-1].tick == 999


def test_recording_is_charged_what_it_adds() -> None:
    bench = Bench()
    bench.sensor.took_ns, bench.core_ns = 300, 1000

    class SlowRecorder(LoopObserver):
        def sent(self, *_: object) -> None:
            work(bench.clock, 70)

    bench.observers = (bench.stopwatch, SlowRecorder(), bench.stopwatch.recording)
    bench.trial(20)
    spread = bench.stopwatch.spread
    assert (spread(TickSection.RECORD).mean_ns, spread(TickSection.REST).count) == (70, 0)
    assert (spread(TickSection.FORCE).mean_ns, spread(TickSection.CONTROL).mean_ns) == (300, 1000)
    assert spread(BUSY).mean_ns == 1370


def test_the_report_is_a_table_and_plain_data() -> None:
    bench = Bench(Limits(warn_late_ns=MS))
    bench.sensor.took_ns = 70_000
    bench.trial(10)
    text = table(bench.stopwatch)
    assert "read force" in text
    assert "0.98%" in text
    assert "ticks later than 1 ms: 0" in text
    data = json.loads(json.dumps(plain(bench.stopwatch)))
    assert data["ticks"] == 10
    assert data["sections"]["read force"]["max_ns"] == 70_000
