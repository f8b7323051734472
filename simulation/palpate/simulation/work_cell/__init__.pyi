from .accuracy import accuracy_lines as accuracy_lines
from .cell import WorkCell as WorkCell
from .conditions import ConditionsConfig as ConditionsConfig
from .config import CellConfig as CellConfig
from .config import SensorConfig as SensorConfig
from .contact_shapes import PLATE_REACH_M as PLATE_REACH_M
from .model import build_work_cell as build_work_cell
from .trial_world import trial_world as trial_world
