from .axial_check import HIGHEST_SHARE as HIGHEST_SHARE
from .axial_check import LOWEST_SHARE as LOWEST_SHARE
from .axial_check import AxialCheck as AxialCheck
from .axial_check import Mean as Mean
from .proof import PAST_PLATE_M as PAST_PLATE_M
from .proof import ContactProof as ContactProof
from .proof import NoProof as NoProof
from .proof import Proof as Proof
