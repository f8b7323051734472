from .agent import Agent as Agent
from .kind import insertion_workspace as insertion_workspace
from .task import InsertionTask as InsertionTask
