from .examination import Examination as Examination
from .findings import DeviceReport as DeviceReport
from .findings import Level as Level
from .findings import summary_text as summary_text
from .push import Person as Person
