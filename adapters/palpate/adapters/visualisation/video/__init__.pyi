from .picture import Painter as Painter
from .trajectory import trajectory_of as trajectory_of
from .video import require_video as require_video
from .video import write_gif as write_gif
from .video import write_mp4 as write_mp4
