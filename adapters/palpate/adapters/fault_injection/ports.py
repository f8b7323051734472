"""All four ports with faults."""

from __future__ import annotations

from collections.abc import Sequence

from palpate.adapters.fault_injection.arm import FaultyArm
from palpate.adapters.fault_injection.clock import FaultyClock
from palpate.adapters.fault_injection.plan import PORTS, FaultPlan
from palpate.adapters.fault_injection.schedule import Tell
from palpate.adapters.fault_injection.sensors import MAX_AGE_NS, FaultyForceSensor, FaultyJointEncoder
from palpate.core.ports.devices import Ports


def faulty(
    ports: Ports, plans: Sequence[FaultPlan], tell: Tell | None = None, *, max_age_ns: int = MAX_AGE_NS
) -> Ports:
    """The four ports, decorated. Decorate anew for each trial: ticks count from the first use.

    The rig keeps the plain ports and leads their lives; the trial runs over the decorated ones.

    Args:
        ports: The ports.
        plans: Faults of any of them; those of one port meet what passes in this order.
        tell: Is told of each delivery.
        max_age_ns: Age above which a sample that a fault holds back is marked ``STALE``.
    """
    own = {port: [plan for plan in plans if plan.port == port] for port in PORTS}
    clock = ports.clock
    return Ports(
        FaultyClock(clock, own["clock"], tell),
        FaultyForceSensor(ports.force_sensor, clock, own["force_sensor"], tell, max_age_ns=max_age_ns),
        FaultyJointEncoder(ports.joint_encoder, clock, own["joint_encoder"], tell, max_age_ns=max_age_ns),
        FaultyArm(ports.arm, clock, own["arm"], tell),
    )
