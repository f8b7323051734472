from .agent import Agent as Agent
from .kind import FULL_DEPTH_TOLERANCE_M as FULL_DEPTH_TOLERANCE_M
from .kind import INSERTION as INSERTION
from .kind import Insertion as Insertion
from .task import InsertionTask as InsertionTask
from .trial_state import InsertionState as InsertionState
