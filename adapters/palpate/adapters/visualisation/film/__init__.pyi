from .course import course_of as course_of
from .film import require_video as require_video
from .film import write_gif as write_gif
from .film import write_mp4 as write_mp4
from .picture import Painter as Painter
