from .condition import SUMMARY as SUMMARY
from .condition import Condition as Condition
from .condition import make as make
from .document import Study as Study
from .folder import STUDY_FILE as STUDY_FILE
from .folder import StudyFolder as StudyFolder
from .settings import setting_of as setting_of
