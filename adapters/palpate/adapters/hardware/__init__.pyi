from .approach import find_approach as find_approach
from .clock import MonotonicClock as MonotonicClock
from .emulated_cell import CellMoment as CellMoment
from .emulated_cell import EmulatedCell as EmulatedCell
from .emulated_cell import EmulationConfig as EmulationConfig
from .plugins import ArmAdapter as ArmAdapter
from .plugins import RigContext as RigContext
from .rig import HardwareRig as HardwareRig
