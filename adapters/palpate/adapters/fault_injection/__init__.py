"""Faults on demand: decorators over the four ports that do what broken devices, wires and computers do.

A decorated port still *is* the port, so that a trial runs over it unchanged::

    plans = [FaultPlan("drop", "force_sensor", first_tick=300, duration_ticks=20)]
    run_trial(task, faulty(rig.ports, plans, notify=log), setup)

``stop`` and the life cycle always pass through, whatever the fault: nothing in here may keep an arm from being stopped.
"""

from palpate.adapters.fault_injection.arm import FaultyArm
from palpate.adapters.fault_injection.clock import FaultyClock
from palpate.adapters.fault_injection.plan import KINDS, PORTS, FaultPlan
from palpate.adapters.fault_injection.ports import FaultyForceSensor, FaultyJointEncoder, faulty
from palpate.adapters.fault_injection.schedule import FaultDelivery

__all__ = [
    "KINDS",
    "PORTS",
    "FaultDelivery",
    "FaultPlan",
    "FaultyArm",
    "FaultyClock",
    "FaultyForceSensor",
    "FaultyJointEncoder",
    "faulty",
]
