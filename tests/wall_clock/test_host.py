"""What excuses a test, and what never does."""

import os
import signal
import time
from collections.abc import Iterator

import pytest

from tests.wall_clock.host import MOST_EXCUSED, Host, LateError


@pytest.fixture
def watched() -> Iterator[Host]:
    """A host of this test alone: what it excuses does not count."""
    watched = Host()
    try:
        yield watched
    finally:
        watched.close()


def hold_up(watched: Host, seconds: float) -> None:
    os.kill(watched._probe.pid, signal.SIGSTOP)
    time.sleep(seconds)
    os.kill(watched._probe.pid, signal.SIGCONT)


def test_a_sleeper_that_was_held_up_is_seen(watched: Host) -> None:
    since_s = time.monotonic()
    hold_up(watched, 0.2)
    assert watched.lateness_s(since_s) > 0.15
    assert watched.lateness_s(time.monotonic() + 3600.0) == 0.0


def test_each_processor_is_watched(watched: Host) -> None:
    expected = {str(processor) for processor in sorted(os.sched_getaffinity(0))[:4]}
    assert {processor for _, processor, *_ in watched._spans} == expected


def test_lateness_is_excused_where_the_host_was_late_and_not_too_often(watched: Host) -> None:
    def late() -> None:
        with watched.judged(0.1):
            hold_up(watched, 0.2)
            raise LateError("too late")

    for _ in range(MOST_EXCUSED):
        with pytest.raises(pytest.skip.Exception, match="the host came late"):
            late()
    with pytest.raises(LateError):
        late()


def test_lateness_is_not_excused_where_the_host_was_in_time(watched: Host) -> None:
    with pytest.raises(LateError), watched.judged(1e6):
        raise LateError("too late")
    with pytest.raises(LateError), watched.judged(1e6):
        watched.wait_for(lambda: False, 0.01)


def test_a_wrong_result_is_never_excused(watched: Host) -> None:
    with pytest.raises(AssertionError, match="wrong value"), watched.judged(-1.0, OSError, "^late"):
        raise AssertionError("wrong value")
    with pytest.raises(OSError, match="lost a frame"), watched.judged(-1.0, OSError, "^late"):
        raise OSError("lost a frame")
