from .device import Jr3 as Jr3
from .device import shut_down as shut_down
from .device import start_up as start_up
from .messages import LEFT_HANDED as LEFT_HANDED
from .messages import RIGHT_HANDED as RIGHT_HANDED
