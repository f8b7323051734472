from .kind import SURFACE_FOLLOW as SURFACE_FOLLOW
from .task import FollowOptions as FollowOptions
from .task import FollowTask as FollowTask
