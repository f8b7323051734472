"""Fakes whose values show the tick at which they were taken, read tick by tick through faults."""

from dataclasses import dataclass, field

from palpate.adapters.fault_injection import FaultDelivery, FaultPlan, FaultyArm, FaultyForceSensor, FaultyJointEncoder
from palpate.core.errors import DeviceError
from palpate.core.ports.contracts import TICK_NS, FakeClock
from palpate.core.ports.values import AppliedCommand, JointCommand, JointSample, WrenchSample
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder

HOME_RAD = (0.0, 0.0, 0.0)


def wrenches(
    *plans: FaultPlan, ticks: int = 12, delivered: list[FaultDelivery] | None = None
) -> list[WrenchSample | DeviceError]:
    """What is read in each tick; the forces of tick k are all k + 1 N, the torques a tenth of that."""
    clock = FakeClock()
    sensor = FakeForceSensor(clock)
    faulty = FaultyForceSensor(sensor, clock, plans, None if delivered is None else delivered.append)
    found: list[WrenchSample | DeviceError] = []
    with faulty:
        for tick in range(ticks):
            level = tick + 1.0
            sensor.load_N, sensor.load_Nm = (level, level, level), (level / 10, level / 10, level / 10)
            try:
                found.append(faulty.read())
            except DeviceError as error:
                found.append(error)
            clock.advance()
    return found


def samples(*plans: FaultPlan, ticks: int = 12) -> list[WrenchSample]:
    """Likewise, when none may fail."""
    found = wrenches(*plans, ticks=ticks)
    assert all(isinstance(sample, WrenchSample) for sample in found)
    return [sample for sample in found if isinstance(sample, WrenchSample)]


def angles(*plans: FaultPlan, ticks: int = 12) -> list[JointSample]:
    """The same of encoders; the angles of tick k are k, 2k and 3k mrad."""
    clock = FakeClock()
    k = [0]
    encoder = FakeJointEncoder(clock, lambda: (1e-3 * k[0], 2e-3 * k[0], 3e-3 * k[0]))
    faulty = FaultyJointEncoder(encoder, clock, plans)
    found = []
    with faulty:
        for k[0] in range(ticks):
            found.append(faulty.read())
            clock.advance()
    return found


@dataclass
class ArmBench:
    """An arm with faults that is sent one command a tick: at tick k all joints to k + 1 mrad."""

    plans: tuple[FaultPlan, ...] = ()
    delivered: list[FaultDelivery] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.clock = FakeClock()
        wide = (-10.0,) * 3, (10.0,) * 3
        self.plain = FakeArm(self.clock, HOME_RAD, lower_rad=wide[0], upper_rad=wide[1], max_step_rad=0.1)
        self.arm = FaultyArm(self.plain, self.clock, self.plans, self.delivered.append)
        self.arm.configure()
        self.arm.activate()
        self.tick = 0

    def step(self) -> tuple[AppliedCommand, float]:
        """What was delivered, and where the first joint then stands, in mrad."""
        self.tick += 1
        applied = self.arm.send(JointCommand((1e-3 * self.tick,) * 3))
        self.clock.advance()
        return applied, round(1e3 * self.plain.position_rad()[0], 6)

    def places(self, ticks: int) -> list[float]:
        """Where the first joint stands after each tick, in mrad."""
        return [self.step()[1] for _ in range(ticks)]


def fz(found: list[WrenchSample]) -> list[float]:
    """The forces along z, N."""
    return [sample.force_N[2] for sample in found]


__all__ = ["HOME_RAD", "TICK_NS", "ArmBench", "angles", "fz", "samples", "wrenches"]
