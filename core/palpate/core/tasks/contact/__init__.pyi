from .dither import Dither as Dither
from .monitor import PAST_PLATE_M as PAST_PLATE_M
from .monitor import Monitor as Monitor
from .response import Response as Response
from .response import Verdict as Verdict
from .touch_task import TouchTask as TouchTask
from .trial_state import TrialState as TrialState
from .way_to_start import RunningPhase as RunningPhase
