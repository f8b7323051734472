from .automaton import machine_picture as machine_picture
from .learned import hidden_picture as hidden_picture
from .viewer import viewed as viewed
