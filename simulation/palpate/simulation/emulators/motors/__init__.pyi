from .plant import AXES as AXES
from .plant import HOME_RAD as HOME_RAD
from .plant import DirectGears as DirectGears
from .plant import JointPlant as JointPlant
