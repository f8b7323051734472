from .config import SupervisionConfig as SupervisionConfig
from .config import weakened_lines as weakened_lines
from .config import weaker_settings as weaker_settings
from .fit import WITHDRAWAL_SHARE as WITHDRAWAL_SHARE
from .fit import limits_line as limits_line
from .fit import require_fitting as require_fitting
from .supervisor import Supervisor as Supervisor
from .watches import require_raw as require_raw
