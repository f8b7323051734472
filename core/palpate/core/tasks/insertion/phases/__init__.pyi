from .approach import Approach as Approach
from .equipment import Controllers as Controllers
from .equipment import Equipment as Equipment
from .explore import Explore as Explore
from .insert import Insert as Insert
from .insert import Stage as Stage
