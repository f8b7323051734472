"""Requests to the system are granted or refused in words, held where they belong, and given back."""

import gc
import os
import resource
import subprocess
import sys

import pytest

from palpate.adapters.config import RealTimeConfig
from palpate.adapters.hardware.real_time import RealTime, join_loop, take_real_time

FLAG = os.SCHED_RESET_ON_FORK
ALL = RealTimeConfig(scheduling=True, priority=7, cpu=min(os.sched_getaffinity(0)), freeze_objects=True)


class FakeKernel:
    """Keeps what was requested; the calling thread stays as it is."""

    def __init__(self, monkeypatch):
        self.policy, self.priority, self.cpus = 0, 0, {0, 1}
        monkeypatch.setattr(os, "sched_getscheduler", lambda pid: self.policy)
        monkeypatch.setattr(os, "sched_getparam", lambda pid: os.sched_param(self.priority))
        monkeypatch.setattr(os, "sched_setscheduler", self.set_scheduler)
        monkeypatch.setattr(os, "sched_getaffinity", lambda pid: set(self.cpus))
        monkeypatch.setattr(os, "sched_setaffinity", self.set_affinity)

    def set_scheduler(self, pid, policy, parameter):
        self.policy, self.priority = policy, parameter.sched_priority

    def set_affinity(self, pid, cpus):
        self.cpus = set(cpus)


@pytest.fixture
def kernel(monkeypatch):
    return FakeKernel(monkeypatch)


def refuse(*words):
    raise PermissionError(1, "Operation not permitted")


def test_granted_requests_are_held_where_they_belong_and_given_back(kernel):
    before = sys.getswitchinterval()
    with RealTime(ALL) as real_time:
        assert [grant.granted for grant in real_time.request_results] == [True] * 3
        assert gc.get_freeze_count() > 0
        for _ in range(2):
            # A log's writer that is started here inherits neither priority nor CPU.
            assert (kernel.policy & ~FLAG, kernel.priority, kernel.cpus) == (os.SCHED_OTHER, 0, {0, 1})
            with real_time.loop():
                assert (kernel.policy, kernel.priority, kernel.cpus) == (os.SCHED_FIFO | FLAG, 7, {ALL.cpu})
                assert sys.getswitchinterval() == pytest.approx(0.0001)
    assert (kernel.policy & ~FLAG, kernel.cpus, gc.get_freeze_count()) == (os.SCHED_OTHER, {0, 1}, 0)
    assert sys.getswitchinterval() == before


def test_trial_that_fails_gives_everything_back(kernel):
    with pytest.raises(ZeroDivisionError), RealTime(ALL) as real_time, real_time.loop():
        raise ZeroDivisionError
    assert (kernel.policy & ~FLAG, kernel.cpus, gc.get_freeze_count()) == (os.SCHED_OTHER, {0, 1}, 0)


def test_refusal_is_reported_with_a_remedy_and_the_rest_continues(kernel, monkeypatch):
    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    with RealTime(ALL) as real_time, real_time.loop():
        assert [grant.granted for grant in real_time.request_results] == [False, True, True]
        assert (kernel.policy, kernel.cpus) == (os.SCHED_OTHER, {ALL.cpu})
    assert "refused: real-time scheduling (SCHED_FIFO) at priority 7: Operation not permitted;" in str(
        real_time.request_results[0]
    )
    assert "rtprio" in real_time.request_results[0].reason
    assert not take_real_time(7).granted
    join_loop(ALL)


def test_memory_below_a_limit_is_not_locked(monkeypatch):
    monkeypatch.setattr(resource, "getrlimit", lambda which: (65536, 65536))
    monkeypatch.setattr(resource, "setrlimit", refuse)
    with RealTime(RealTimeConfig(lock_memory=True)) as real_time:
        assert "memlock unlimited" in str(real_time.request_results[0])
        assert not real_time.request_results[0].granted


def test_real_system_answers_and_a_child_does_not_inherit_the_loop_s_priority():
    (missing,) = RealTime(RealTimeConfig(cpu=4000)).__enter__().request_results
    assert "refused: the loop on CPU 4000 alone: Invalid argument" in str(missing)
    with RealTime(RealTimeConfig(scheduling=True, priority=1)) as real_time:
        if not real_time.request_results[0].granted:
            pytest.skip(str(real_time.request_results[0]))
        with real_time.loop():
            assert os.sched_getscheduler(0) & ~FLAG == os.SCHED_FIFO
            program = "import os; print(os.sched_getscheduler(0))"
            child = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
            assert child.stdout == f"{os.SCHED_OTHER}\n"
        assert os.sched_getscheduler(0) & ~FLAG == os.SCHED_OTHER
