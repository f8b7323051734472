from .baum_welch import RecordedTrial as RecordedTrial
from .displacement_hmm import DisplacementHmm as DisplacementHmm
from .learner import GREEDY_ACTIONS as GREEDY_ACTIONS
from .learner import HmmLearner as HmmLearner
from .learner import HmmParameters as HmmParameters
from .point_based import FinitePomdp as FinitePomdp
from .point_based import StateBelief as StateBelief
