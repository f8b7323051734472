from .can_bus import BusFrame as BusFrame
from .can_bus import CanNode as CanNode
from .can_bus import EmulatedCanBus as EmulatedCanBus
from .pty_server import PtyServer as PtyServer
from .slcan import SlcanAdapter as SlcanAdapter
