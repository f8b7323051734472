"""The clock that paces the simulated cell keeps the contract of the port, and never lets a sample be of the future."""

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchmarks.paced_clock import PacedClock
from palpate.adapters.mujoco.ports import MujocoJointEncoder
from palpate.core.control_loop import next_slot, tick_time_ns
from palpate.core.ports.contracts import ClockContract, ClockRig, FakeClock

# As a module: its suites would be run here once more otherwise.
from tests.contracts import test_mujoco as mujoco

TICK_NS = mujoco.TICK_NS


class TestPacedClock(ClockContract):
    def make(self) -> ClockRig:
        # Real time is a fake here: that the real clock keeps its own contract is tried elsewhere.
        bench = mujoco.Bench.fresh()
        return ClockRig(
            clock=PacedClock(bench.cell, FakeClock(12_345)), tolerance_ns=1, step_ns=50_000_000, deadlines=50
        )


def paced() -> tuple[mujoco.Bench, FakeClock, PacedClock]:
    bench, real = mujoco.Bench.fresh(), FakeClock(987)
    return bench, real, PacedClock(bench.cell, real)


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(phase_ns=st.integers(0, TICK_NS), late_ns=st.lists(st.integers(0, 4 * TICK_NS), max_size=10))
def test_samples_are_at_most_a_tick_old_and_never_of_the_future(phase_ns: int, late_ns: list[int]) -> None:
    bench, real, clock = paced()
    encoder = MujocoJointEncoder(bench.cell)
    real.sleep_until(real.now_ns() + phase_ns)
    with encoder:
        start_ns, slot = clock.now_ns(), 0
        for late in [0, *late_ns]:
            deadline_ns = tick_time_ns(start_ns, slot)
            clock.sleep_until(deadline_ns)
            sample = encoder.read()
            assert deadline_ns - TICK_NS - 1 <= sample.source_time_ns <= clock.now_ns()
            slot = next_slot(start_ns, slot, clock.now_ns())
            # The tick's work takes so long.
            real.sleep_until(real.now_ns() + late)
