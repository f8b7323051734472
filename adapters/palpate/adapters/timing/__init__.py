"""Where the time of each tick goes, how late ticks are, and whose fault that is; see :class:`Stopwatch`."""

from palpate.adapters.timing.attribution import Attribution, Cause, ThreadAccount, attribute
from palpate.adapters.timing.histogram import Histograms, Spread
from palpate.adapters.timing.lateness import LateTick, Limits, SlowCore
from palpate.adapters.timing.ports import timed, timed_recording
from palpate.adapters.timing.report import plain, table
from palpate.adapters.timing.sections import Section
from palpate.adapters.timing.stopwatch import Stopwatch
from palpate.adapters.timing.task import timed_parts

__all__ = [
    "Attribution",
    "Cause",
    "Histograms",
    "LateTick",
    "Limits",
    "Section",
    "SlowCore",
    "Spread",
    "Stopwatch",
    "ThreadAccount",
    "attribute",
    "plain",
    "table",
    "timed",
    "timed_parts",
    "timed_recording",
]
