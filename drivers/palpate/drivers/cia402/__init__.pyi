from .codec import DriveState as DriveState
from .device import Cia402Arm as Cia402Arm
from .link import CanopenLink as CanopenLink
from .settings import ArmSettings as ArmSettings
from .settings import JointDrive as JointDrive
