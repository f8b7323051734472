"""The contracts of the four ports, as test suites that ship with the package.

What types cannot express about a port stands here, clause by clause, and every adapter is held to it:
ours, a simulator, a replayed log, and a stranger's driver. A suite needs a *rig*: the adapter plus the
knobs by which a test acts on the world behind it::

    class TestMySensor(ForceSensorContract):
        def make(self) -> ForceSensorRig:
            world = MyEmulator()
            return ForceSensorRig(device=MySensor(world), clock=world.clock, advance=world.advance, ...)

pytest runs such a class as it is. Without pytest, :func:`run_clauses` does.
"""

from palpate.core.ports.contracts.arm_command import ArmCommandContract
from palpate.core.ports.contracts.clock import ClockContract
from palpate.core.ports.contracts.force_sensor import ForceSensorContract
from palpate.core.ports.contracts.joint_encoder import JointEncoderContract
from palpate.core.ports.contracts.rigs import ArmCommandRig, ClockRig, ForceSensorRig, JointEncoderRig
from palpate.core.ports.contracts.running import Clause, ClauseOutcome, ClauseResult, clauses, run_clauses
from palpate.core.ports.contracts.violations import ClauseNotApplicable, ContractViolation

__all__ = [
    "ArmCommandContract",
    "ArmCommandRig",
    "Clause",
    "ClauseNotApplicable",
    "ClauseOutcome",
    "ClauseResult",
    "ClockContract",
    "ClockRig",
    "ContractViolation",
    "ForceSensorContract",
    "ForceSensorRig",
    "JointEncoderContract",
    "JointEncoderRig",
    "clauses",
    "run_clauses",
]
