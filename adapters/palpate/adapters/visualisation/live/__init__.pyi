from .display import LearningSoFar as LearningSoFar
from .emulation import EmulationView as EmulationView
from .export import export_pictures as export_pictures
from .live_view import LiveView as LiveView
