from .device import RDT_PORT as RDT_PORT
from .device import NetFt as NetFt
from .device import UdpWire as UdpWire
from .settings import NetFtBox as NetFtBox
from .settings import parse_box as parse_box
from .settings import read_box as read_box
