from .box import EmulatedBox as EmulatedBox
from .box import EmulatedBoxConfig as EmulatedBoxConfig
from .server import NetFtServer as NetFtServer
