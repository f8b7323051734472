"""Faults of time, and all four ports together."""

from palpate.adapters.fault_injection import FaultDelivery, FaultPlan, FaultyArm, FaultyClock, faulty
from palpate.core.ports.contracts import TICK_NS, FakeClock
from palpate.core.ports.devices import Ports
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder

MS = 1_000_000


def times_ms(*plans: FaultPlan, delivered: list[FaultDelivery] | None = None) -> list[int]:
    """The time after each of six sleeps to 10, 20, ... ms."""
    clock = FaultyClock(FakeClock(), plans, None if delivered is None else delivered.append)
    found = []
    for tick in range(1, 7):
        clock.sleep_until(10 * tick * MS)
        found.append(clock.now_ns() // MS)
    return found


def test_time_jumps_forwards() -> None:
    delivered: list[FaultDelivery] = []
    assert times_ms(FaultPlan("clock-jump", "clock", 2, time_s=0.015), delivered=delivered) == [10, 20, 45, 45, 50, 60]
    assert delivered == [FaultDelivery(2, 30 * MS, "clock-jump", "clock", "time jumps by +0.015 s")]


def test_a_jump_backwards_makes_time_stand_still() -> None:
    base, delivered = FakeClock(), list[FaultDelivery]()
    clock = FaultyClock(base, [FaultPlan("clock-jump", "clock", 1, time_s=-0.015)], delivered.append)
    clock.sleep_until(10 * MS)
    clock.sleep_until(20 * MS)
    shown = []
    for _ in range(4):
        shown.append(clock.now_ns() // MS)
        base.sleep_until(base.now_ns() + 10 * MS)
    assert shown == [20, 20, 25, 35]
    assert "stands still" in delivered[0].text
    # A loop over it waits as long as time stands still.
    clock.sleep_until(100 * MS)
    assert (clock.now_ns(), base.now_ns()) == (100 * MS, 115 * MS)


def test_a_jump_that_ends_is_a_jump_back() -> None:
    delivered: list[FaultDelivery] = []
    found = times_ms(FaultPlan("clock-jump", "clock", 1, duration_ticks=2, time_s=0.012), delivered=delivered)
    assert found == [10, 32, 32, 40, 50, 60]
    assert [(d.tick, d.text.split(",")[0]) for d in delivered] == [
        (1, "time jumps by +0.012 s"),
        (3, "time jumps by -0.012 s"),
    ]


def test_an_overrun_makes_a_tick_longer() -> None:
    delivered: list[FaultDelivery] = []
    plan = FaultPlan("overrun", "clock", 1, duration_ticks=1, time_s=0.025)
    assert times_ms(plan, delivered=delivered) == [10, 45, 45, 45, 50, 60]
    assert [(d.tick, d.text) for d in delivered] == [(1, "the tick takes 0.025 s longer")]


def test_overruns_by_chance_are_reported_each_time() -> None:
    delivered: list[FaultDelivery] = []
    clock = FaultyClock(FakeClock(), [FaultPlan("overrun", "clock", probability=0.4, time_s=0.001)], delivered.append)
    late = []
    for tick in range(1, 50):
        clock.sleep_until(10 * tick * MS)
        late.append(clock.now_ns() != 10 * tick * MS)
    assert [d.tick for d in delivered] == [tick for tick, is_late in enumerate(late) if is_late]
    assert 5 < len(delivered) < 40


def test_all_four_ports_at_once() -> None:
    clock, delivered = FakeClock(), list[FaultDelivery]()
    arm = FakeArm(clock, (0.0,), lower_rad=(-1.0,), upper_rad=(1.0,), max_step_rad=0.1)
    plain = Ports(clock, FakeForceSensor(clock), FakeJointEncoder(clock, arm.position_rad), arm)
    plans = [
        FaultPlan("overrun", "clock", time_s=0.001),
        FaultPlan("saturate", "force_sensor", magnitude=5.0),
        FaultPlan("unit", "joint_encoder", factor=2.0),
        FaultPlan("disconnect", "arm", 1),
        FaultPlan("spike", "force_sensor", 1, magnitude=5.0),
    ]
    ports = faulty(plain, plans, delivered.append)
    for device in (ports.force_sensor, ports.joint_encoder, ports.arm):
        device.configure()
        device.activate()
    ports.clock.sleep_until(TICK_NS)
    ports.force_sensor.read()
    ports.joint_encoder.read()
    assert [(d.port, d.kind) for d in delivered] == [
        ("clock", "overrun"),
        ("force_sensor", "saturate"),
        ("joint_encoder", "unit"),
    ]
    assert isinstance(ports.arm, FaultyArm)
