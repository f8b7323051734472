from .box import NetFtBox as NetFtBox
from .box import fetch_page as fetch_page
from .box import ip_address as ip_address
from .box import parse_box as parse_box
from .stream import RDT_PORT as RDT_PORT
from .stream import NetFt as NetFt
from .stream import RdtStatistics as RdtStatistics
from .stream import UdpWire as UdpWire
