"""Wishes are granted or refused in words, held where they belong, and given back."""

import errno
import gc
import os
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest

from palpate.adapters.config.real_time import RealTimeConfig
from palpate.adapters.hardware.real_time import Kernel, RealTime, join_loop, request, take_real_time

ALL = RealTimeConfig(scheduling=True, priority=7, lock_memory=True, cpu=1, garbage_collection="off", stay_awake=True)
FIFO, FLAG = 1, 0x4000_0000


class FakeKernel(Kernel):
    """A kernel that keeps book, and refuses what it is told to."""

    def __init__(self, *refused: str, limit_bytes: float = float("inf")) -> None:
        self.refused, self.limit_bytes = set(refused), limit_bytes
        self.policy, self.at, self.cpus, self.locked = 0, 0, frozenset((0, 1)), False
        self.awake: list[int] = []

    def scheduling(self) -> tuple[int, int]:
        return self.policy, self.at

    def set_scheduling(self, policy: int, priority: int) -> None:
        self._ask("scheduling" if policy & 0xFF else "ordinary")
        if self.policy & FLAG and not policy & FLAG:
            self._ask("flag")
        self.policy, self.at = policy, priority

    def fifo(self, priority: int, *, inherited: bool = False) -> None:
        self.set_scheduling(FIFO if inherited else FIFO | FLAG, priority)

    def affinity(self) -> frozenset[int]:
        return self.cpus

    def set_affinity(self, cpus: frozenset[int]) -> None:
        self._ask("affinity", errno.EINVAL)
        self.cpus = cpus

    def lock_memory(self) -> None:
        self._ask("memory", errno.ENOMEM)
        self.locked = True

    def unlock_memory(self) -> None:
        self.locked = False

    def stay_awake(self) -> int:
        self._ask("awake", errno.EACCES)
        self.awake.append(11)
        return 11

    def may_sleep(self, held: int) -> None:
        self.awake.remove(held)

    def may_lock_any_amount(self) -> bool:
        return self.limit_bytes == float("inf")

    def memory_limit_bytes(self) -> float:
        return self.limit_bytes

    def priority_limit(self) -> float:
        return 0.0

    def _ask(self, what: str, number: int = errno.EPERM) -> None:
        if what in self.refused:
            raise OSError(number, os.strerror(number))


@pytest.fixture(autouse=True)
def _garbage_is_collected() -> Iterator[None]:
    yield
    assert gc.isenabled()


def test_without_wishes_nothing_happens() -> None:
    kernel = FakeKernel("scheduling", "memory", "affinity")
    assert request(RealTimeConfig(), kernel) == []


def test_what_is_granted_is_held_where_it_belongs_and_given_back() -> None:
    kernel = FakeKernel()
    with RealTime(ALL, kernel) as real_time:
        assert [grant.granted for grant in real_time.grants] == [True] * 6
        # What is started here, as a log's writer or a bus's thread is, inherits neither priority nor CPU.
        assert (kernel.policy, kernel.cpus, kernel.locked, kernel.awake) == (0, {0, 1}, True, [11])
        for _ in range(2):
            with real_time.loop():
                assert (kernel.policy, kernel.at, kernel.cpus) == (FIFO | FLAG, 7, {1})
                assert not gc.isenabled()
            assert (kernel.policy, kernel.cpus) == (0, {0, 1})
            assert gc.isenabled()
    assert not kernel.locked
    assert not kernel.awake


def test_other_threads_let_go_of_the_interpreter_soon_while_a_trial_runs() -> None:
    before = sys.getswitchinterval()
    with RealTime(RealTimeConfig(), FakeKernel()) as real_time, real_time.loop():
        assert sys.getswitchinterval() == pytest.approx(0.0001)
    assert sys.getswitchinterval() == before


def test_a_trial_that_fails_gives_everything_back() -> None:
    kernel = FakeKernel()

    def fail() -> None:
        with RealTime(ALL, kernel) as real_time, real_time.loop():
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert (kernel.policy, kernel.cpus, kernel.locked, kernel.awake) == (0, {0, 1}, False, [])


@pytest.mark.parametrize(
    ("what", "number", "reason", "remedy"),
    [
        ("scheduling", 0, "operation not permitted", "CAP_SYS_NICE"),
        ("affinity", 1, "invalid argument", "0, 1"),
        ("memory", 2, "cannot allocate memory", "CAP_IPC_LOCK"),
        ("awake", 3, "permission denied", "/dev/cpu_dma_latency"),
    ],
)
def test_a_refusal_is_told_with_what_would_help_and_the_rest_goes_on(
    what: str, number: int, reason: str, remedy: str
) -> None:
    kernel = FakeKernel(what)
    with RealTime(ALL, kernel) as real_time, real_time.loop():
        refused = real_time.grants[number]
        assert [grant.granted for grant in real_time.grants].count(False) == 1
    assert not refused.granted
    assert refused.reason == reason
    assert remedy in refused.remedy
    assert "\n" not in str(refused)


def test_memory_is_not_locked_under_a_limit_that_a_later_allocation_would_meet() -> None:
    kernel = FakeKernel(limit_bytes=8192.0 * 1024)
    grants = request(RealTimeConfig(lock_memory=True), kernel)
    assert [grant.granted for grant in grants] == [False]
    assert "8192 KiB" in grants[0].reason


def test_a_flag_that_may_not_be_taken_off_stays_and_the_priority_goes() -> None:
    kernel = FakeKernel("flag")
    with RealTime(RealTimeConfig(scheduling=True), kernel) as real_time, real_time.loop():
        pass
    assert kernel.policy == FLAG


@pytest.mark.parametrize("garbage", ["frozen", "off"])
def test_frozen_objects_are_thawed(garbage: str) -> None:
    with RealTime(RealTimeConfig(garbage_collection=garbage), FakeKernel()):
        assert gc.get_freeze_count() > 0
    assert gc.get_freeze_count() == 0


def test_the_system_itself_is_asked_without_an_error() -> None:
    before = Kernel().scheduling(), Kernel().affinity()
    grants = request(RealTimeConfig(scheduling=True, priority=1, cpu=min(Kernel().affinity())))
    assert len(grants) == 2
    assert (Kernel().scheduling()[1], Kernel().affinity()) == (before[0][1], before[1])


def test_processors_stay_awake_while_the_file_is_open(tmp_path, monkeypatch) -> None:
    device = tmp_path / "cpu_dma_latency"
    device.write_bytes(b"")
    monkeypatch.setattr("palpate.adapters.hardware.real_time.kernel._WAKE_UP", str(device))

    def open_files() -> list[str]:
        return [os.readlink(link) for link in os.scandir("/proc/self/fd") if os.path.exists(link)]

    with RealTime(RealTimeConfig(stay_awake=True)) as real_time:
        assert [grant.granted for grant in real_time.grants] == [True]
        # No microseconds to wake up in, as a number of 32 bits.
        assert device.read_bytes() == b"\0\0\0\0"
        assert str(device) in open_files()
    assert str(device) not in open_files()
    device.unlink()
    assert not request(RealTimeConfig(stay_awake=True))[0].granted


def test_a_cpu_that_is_not_there_is_refused() -> None:
    (grant,) = request(RealTimeConfig(cpu=4000))
    assert not grant.granted


def test_what_the_loop_starts_does_not_inherit_its_priority() -> None:
    with RealTime(RealTimeConfig(scheduling=True, priority=1)) as real_time:
        if not real_time.grants[0].granted:
            pytest.skip("this user may not use real-time scheduling")
        seen: list[int] = []
        with real_time.loop():
            assert os.sched_getscheduler(0) == os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
            thread = threading.Thread(target=lambda: seen.append(os.sched_getscheduler(0)))
            thread.start()
            thread.join()
            child = [sys.executable, "-c", "import os; print(os.sched_getscheduler(0))"]
            seen.append(int(subprocess.run(child, check=True, capture_output=True).stdout))
        assert seen == [os.SCHED_OTHER] * 2
        assert os.sched_getscheduler(0) & 0xFF == os.SCHED_OTHER


def test_a_thread_that_takes_it_for_good_hands_it_on() -> None:
    kernel = FakeKernel()
    assert take_real_time(9, kernel).granted
    assert (kernel.policy, kernel.at) == (FIFO, 9)
    grant = take_real_time(9, FakeKernel("scheduling"))
    assert not grant.granted
    assert "CAP_SYS_NICE" in str(grant)
    seen: list[int] = []

    def take() -> None:
        if not take_real_time(1).granted:
            return
        child = threading.Thread(target=lambda: seen.append(os.sched_getscheduler(0)))
        child.start()
        child.join()

    thread = threading.Thread(target=take)
    thread.start()
    thread.join()
    assert seen in ([], [os.SCHED_FIFO])


@pytest.mark.parametrize(
    ("config", "refused", "left"),
    [
        (RealTimeConfig(), (), (0, 0, {0, 1})),
        (RealTimeConfig(cpu=1), (), (0, 0, {1})),
        (RealTimeConfig(scheduling=True, priority=7), (), (FIFO, 7, {0, 1})),
        (ALL, (), (FIFO, 7, {1})),
        (ALL, ("affinity",), (FIFO, 7, {0, 1})),
        (ALL, ("scheduling",), (0, 0, {1})),
    ],
)
def test_a_thread_that_joins_the_loop_takes_what_the_run_asks_for_and_no_refusal_ends_it(
    config: RealTimeConfig, refused: tuple[str, ...], left: tuple[int, int, set[int]]
) -> None:
    kernel = FakeKernel(*refused)
    join_loop(config, kernel)
    assert (kernel.policy, kernel.at, set(kernel.cpus)) == left


def test_a_system_without_these_calls_refuses_and_ends_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in dir(os) if name.lower().startswith("sched_")]:
        monkeypatch.delattr(os, name)
    grants = request(RealTimeConfig(scheduling=True, cpu=0))
    assert [(grant.granted, "this system has no sched" in grant.reason.lower()) for grant in grants] == [
        (False, True)
    ] * 2
    assert not take_real_time(1).granted
    join_loop(RealTimeConfig(scheduling=True, cpu=0))
