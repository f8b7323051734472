from .approach import Approach as Approach
from .equipment import Equipment as Equipment
from .equipment import Laws as Laws
from .explore import Explore as Explore
from .exploring_checks import ExploringChecks as ExploringChecks
from .insert import Insert as Insert
from .prove import Prove as Prove
from .sinking_checks import SinkingChecks as SinkingChecks
