from .automaton import machine_picture as machine_picture
from .learned import hidden_picture as hidden_picture
from .learned import training_picture as training_picture
from .viewer import ShownClock as ShownClock
from .viewer import Viewer as Viewer
from .viewer import WindowClosedError as WindowClosedError
from .viewer import open_viewer as open_viewer
from .viewer import require_display as require_display
