from .displacement_hmm import DisplacementHmm as DisplacementHmm
from .finite_pomdp import FinitePomdp as FinitePomdp
from .finite_pomdp import StateBelief as StateBelief
from .learner import PATIENCE as PATIENCE
from .learner import HmmLearner as HmmLearner
from .learner import HmmParameters as HmmParameters
from .recorded import RecordedTrial as RecordedTrial
