"""Faults on demand: decorators over the four ports that do what broken devices, wires and computers do.

A decorated port still *is* the port, so that a trial runs over it unchanged::

    plans = [FaultPlan("drop", "force_sensor", first_tick=300, duration_ticks=20)]
    run_trial(task, faulty(rig.ports, plans, notify=log), setup)

``stop`` and the life cycle always pass through, whatever the fault: nothing in here may keep an arm from being stopped.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
