from .finite_pomdp import FinitePomdp as FinitePomdp
from .learner import OFFSET as OFFSET
from .learner import MemoryLearner as MemoryLearner
from .learner import MemoryParameters as MemoryParameters
from .learner import WorldModel as WorldModel
from .offset_model import OffsetModel as OffsetModel
from .recorded import RecordedTrial as RecordedTrial
