from .box import EmulatedBox as EmulatedBox
from .box import NetFtServer as NetFtServer
