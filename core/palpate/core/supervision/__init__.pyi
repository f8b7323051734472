from .config import DEFAULTS as DEFAULTS
from .config import SupervisionConfig as SupervisionConfig
from .config import weakened_lines as weakened_lines
from .fit import require_fitting as require_fitting
from .supervisor import Supervisor as Supervisor
