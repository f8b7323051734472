"""Contracts for the four ports, policies and learners, as test suites that ship with the package.

The suites check, clause by clause, what types cannot express about a port. They apply to built-in adapters, simulators
and third-party drivers. A suite needs a *rig*: the adapter and the controls that a test uses to act on its world::

    class TestMySensor(ForceSensorContract):
        def make(self) -> ForceSensorRig:
            world = MyEmulator()
            return ForceSensorRig(device=MySensor(world), clock=world.clock, advance=world.advance, ...)

pytest runs such a class directly.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
