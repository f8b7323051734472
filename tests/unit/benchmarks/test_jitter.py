from benchmarks.jitter import WatchedPhase, open_task, sleep_only
from palpate.adapters.config import scenario
from palpate.core.control_loop import LoopObserver
from tests.virtual_time import VirtualTime


def test_a_loop_without_trials_runs() -> None:
    clock = VirtualTime()
    phase = WatchedPhase(clock, 140, 0.1)
    sleep_only(open_task(scenario("paper")), phase, phase, range(10), LoopObserver())
    assert phase.over
