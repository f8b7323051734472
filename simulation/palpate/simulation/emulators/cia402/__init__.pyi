from .node import CanopenDrive as CanopenDrive
