from .fit import FEWEST_TOUCHES as FEWEST_TOUCHES
from .learner import BeliefLearner as BeliefLearner
from .model import RINGS_M as RINGS_M
from .model import Directions as Directions
from .model import TouchModel as TouchModel
from .settings import BeliefParameters as BeliefParameters
from .touches import Touch as Touch
from .touches import TouchedTrial as TouchedTrial
