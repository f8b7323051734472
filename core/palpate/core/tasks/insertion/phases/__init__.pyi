from .approach import Approach as Approach
from .equipment import Equipment as Equipment
from .equipment import Laws as Laws
from .explore import Explore as Explore
from .insert import Insert as Insert
from .insert import Stage as Stage
