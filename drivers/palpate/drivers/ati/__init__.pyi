from .box import NetFtBox as NetFtBox
from .box import parse_box as parse_box
from .box import read_box as read_box
from .stream import RDT_PORT as RDT_PORT
from .stream import NetFt as NetFt
from .stream import UdpWire as UdpWire
