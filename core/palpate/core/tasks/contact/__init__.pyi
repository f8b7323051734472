from .contact_task import ContactTask as ContactTask
from .dither import Dither as Dither
from .monitor import PAST_PLATE_M as PAST_PLATE_M
from .monitor import Monitor as Monitor
from .path_to_start import RunningPhase as RunningPhase
from .response import Response as Response
from .trial_state import TrialState as TrialState
