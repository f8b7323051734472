from .link import CanFrame as CanFrame
from .link import CanLink as CanLink
from .link import open_bus as open_bus
