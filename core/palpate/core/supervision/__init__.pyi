from .config import SupervisionConfig as SupervisionConfig
from .config import weakened_lines as weakened_lines
from .config import weaker_settings as weaker_settings
from .fit import require_fitting as require_fitting
from .supervisor import Supervisor as Supervisor
