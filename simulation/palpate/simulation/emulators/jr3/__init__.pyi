from .can import Jr3CanNode as Jr3CanNode
from .sensor import Jr3Config as Jr3Config
