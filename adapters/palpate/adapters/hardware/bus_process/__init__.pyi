from .hosted import HostedArm as HostedArm
from .hosted import OperatorsHand as OperatorsHand
from .process import host_arm as host_arm
