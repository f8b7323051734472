from .corner_first import CornerFirst as CornerFirst
from .give_way import GiveWay as GiveWay
from .hypotheses import Hypotheses as Hypotheses
from .kind import INSERTION_6DOF as INSERTION_6DOF
from .levelled import Levelled as Levelled
from .options import SpatialOptions as SpatialOptions
from .task import SpatialTask as SpatialTask
