from .automaton import machine_picture as machine_picture
from .viewer import viewed as viewed
