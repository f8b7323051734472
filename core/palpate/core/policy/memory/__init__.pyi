from .belief import StateBelief as StateBelief
from .finite_pomdp import FinitePomdp as FinitePomdp
from .learner import PATIENCE as PATIENCE
from .learner import MemoryLearner as MemoryLearner
from .learner import MemoryParameters as MemoryParameters
from .offset_model import OffsetModel as OffsetModel
from .recorded import RecordedTrial as RecordedTrial
