from .config import SupervisionConfig as SupervisionConfig
from .config import weakened_lines as weakened_lines
from .config import weaker_settings as weaker_settings
from .fit import require_fitting as require_fitting
from .limits import WITHDRAWAL_SHARE as WITHDRAWAL_SHARE
from .limits import force_limits as force_limits
from .limits import limits_line as limits_line
from .supervisor import Supervisor as Supervisor
