"""An arm under the operator's stop keeps the contract as it does without."""

from dataclasses import replace

from palpate.adapters.contracts import ArmCommandContract, ArmCommandRig
from palpate.adapters.hardware.operator_stop import GuardedArm, OperatorStop

# As a module: a suite that is imported by name would be run here once more as it is.
from tests.contracts import test_fake as fake


class TestGuardedArm(ArmCommandContract):
    def make(self) -> ArmCommandRig:
        rig = fake.TestFakeArm().make()
        return replace(rig, device=GuardedArm(rig.device, OperatorStop(rig.device)))
