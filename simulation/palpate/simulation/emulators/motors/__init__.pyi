from .plant import AXES as AXES
from .plant import HOME_RAD as HOME_RAD
from .plant import DirectMotors as DirectMotors
from .plant import JointPlant as JointPlant
from .plant import Plant as Plant
