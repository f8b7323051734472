"""Each kind of fault on the way of commands."""

import pytest

from palpate.adapters.fault_injection import FaultPlan, FaultyArm
from palpate.core.errors import CommandError, ConfigurationError, DeviceError
from palpate.core.ports import CommandReason, JointCommand
from tests.unit.adapters.fault_injection.bench import ArmBench


def test_dropped_commands_are_acknowledged_and_lost() -> None:
    bench = ArmBench((FaultPlan("drop", "arm", 2, duration_ticks=2),))
    steps = [bench.step() for _ in range(6)]
    assert [place for _, place in steps] == [1.0, 2.0, 2.0, 2.0, 5.0, 6.0]
    assert {applied.reason for applied, _ in steps} == {CommandReason.AS_ASKED}
    assert steps[2][0].position_rad == (3e-3,) * 3
    assert [(d.tick, d.kind, d.port) for d in bench.delivered] == [(2, "drop", "arm")]


def test_delayed_commands_come_late_and_are_dropped_when_the_delay_ends() -> None:
    bench = ArmBench((FaultPlan("delay", "arm", 1, duration_ticks=5, delay_ticks=2),))
    assert bench.places(8) == [1.0, 1.0, 1.0, 2.0, 3.0, 4.0, 7.0, 8.0]


def test_the_newest_command_of_a_tick_is_the_one_that_comes_late() -> None:
    bench = ArmBench((FaultPlan("delay", "arm", delay_ticks=1),))
    for angle in (0.01, 0.02, 0.03):
        bench.arm.send(JointCommand((angle,) * 3))
    bench.clock.advance()
    bench.arm.send(JointCommand((0.0,) * 3))
    bench.clock.advance()
    assert bench.plain.position_rad() == (0.03,) * 3


def test_a_stuck_arm_says_as_asked_and_stands() -> None:
    bench = ArmBench((FaultPlan("stuck", "arm", 2),))
    steps = [bench.step() for _ in range(5)]
    assert [place for _, place in steps] == [1.0, 2.0, 2.0, 2.0, 2.0]
    assert steps[-1][0].position_rad == (5e-3,) * 3
    assert steps[-1][0].reason is CommandReason.AS_ASKED


def test_nan_on_the_way_is_a_command_error() -> None:
    bench = ArmBench((FaultPlan("nan", "arm", 2, duration_ticks=1),))
    bench.places(2)
    with pytest.raises(CommandError, match="must be finite"):
        bench.step()
    assert [d.tick for d in bench.delivered] == [2]
    bench.clock.advance()
    assert bench.places(1) == [4.0]


def test_wrong_unit_is_limited_by_the_arm_and_answered() -> None:
    bench = ArmBench((FaultPlan("unit", "arm", 1, factor=1000.0),))
    bench.step()
    applied, place = bench.step()
    assert applied.reason is CommandReason.VELOCITY_LIMIT
    assert place == 101.0


def test_a_disconnected_arm_raises_and_can_be_stopped() -> None:
    bench = ArmBench((FaultPlan("disconnect", "arm", 1),))
    bench.step()
    for _ in range(2):
        with pytest.raises(DeviceError, match="does not answer"):
            bench.step()
        bench.clock.advance()
    bench.arm.stop()
    assert bench.plain.send(JointCommand((0.0,) * 3)).reason is CommandReason.STOPPED


@pytest.mark.parametrize("kind", ["drop", "delay", "stuck"])
def test_a_stop_reaches_the_arm_and_is_answered_truly(kind: str) -> None:
    bench = ArmBench((FaultPlan(kind, "arm", 2),))
    bench.places(4)
    bench.arm.stop()
    applied, place = bench.step()
    assert applied.reason is CommandReason.STOPPED
    assert bench.places(5) == [place] * 5


@pytest.mark.parametrize("kind", ["delay", "stuck"])
def test_an_arm_that_was_stopped_underneath_says_so(kind: str) -> None:
    bench = ArmBench((FaultPlan(kind, "arm", 2),))
    bench.places(3)
    bench.plain.stop()
    assert CommandReason.STOPPED in {bench.step()[0].reason for _ in range(5)}


@pytest.mark.parametrize("by", ["arm", "plain"])
def test_activated_again_the_faults_go_on_and_nothing_old_arrives(by: str) -> None:
    bench = ArmBench((FaultPlan("delay", "arm", 0, delay_ticks=3),))
    bench.places(5)
    bench.arm.stop()
    held = bench.plain.position_rad()[0] * 1e3
    device = getattr(bench, by)
    device.deactivate()
    device.activate()
    bench.tick = 50
    # Activated underneath, the first command is what shows it, and goes on plainly.
    expected = [held, held, held, 51.0] if by == "arm" else [51.0, 51.0, 51.0, 51.0, 52.0]
    assert bench.places(len(expected)) == pytest.approx(expected)


def test_plans_and_decorators_combine() -> None:
    bench = ArmBench((FaultPlan("delay", "arm", delay_ticks=1), FaultPlan("unit", "arm", factor=2.0)))
    outer = FaultyArm(bench.arm, bench.clock, [FaultPlan("delay", "arm", delay_ticks=1)])
    bench.arm = outer
    assert bench.places(6) == [0.0, 0.0, 2.0, 4.0, 6.0, 8.0]


def test_a_plan_for_another_port_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="arm, which is what is decorated"):
        ArmBench((FaultPlan("drop", "force_sensor"),))
