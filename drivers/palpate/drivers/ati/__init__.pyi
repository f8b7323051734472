from .box import PAGE as PAGE
from .box import NetFtBox as NetFtBox
from .box import parse_box as parse_box
from .rdt import RDT_PORT as RDT_PORT
from .stream import NetFt as NetFt
from .stream import RdtStatistics as RdtStatistics
from .wire import UdpWire as UdpWire
from .wire import fetch_page as fetch_page
