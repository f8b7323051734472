from .corner_first import CornerFirst as CornerFirst
from .kind import INSERTION_6DOF as INSERTION_6DOF
from .kind import SpatialTask as SpatialTask
from .options import SpatialOptions as SpatialOptions
