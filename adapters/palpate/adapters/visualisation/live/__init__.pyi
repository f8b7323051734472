from .export import export_rerun as export_rerun
from .view import LiveView as LiveView
