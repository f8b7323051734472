"""The contracts of the four ports, of policies and of learners, as test suites that ship with the package.

What types cannot express about a port is checked here, clause by clause, on every adapter: ours, a simulator and a
third-party driver. A suite needs a *rig*: the adapter plus the knobs by which a test acts on the world behind it::

    class TestMySensor(ForceSensorContract):
        def make(self) -> ForceSensorRig:
            world = MyEmulator()
            return ForceSensorRig(device=MySensor(world), clock=world.clock, advance=world.advance, ...)

pytest runs such a class as it is.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
