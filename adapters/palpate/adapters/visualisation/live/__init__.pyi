from .view import LiveView as LiveView
