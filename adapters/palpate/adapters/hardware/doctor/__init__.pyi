from .examination import Examination as Examination
from .examination import Wishes as Wishes
from .findings import FindingsSection as FindingsSection
from .findings import Level as Level
from .findings import section_text as section_text
from .findings import summary_text as summary_text
from .push import Person as Person
from .system import System as System
