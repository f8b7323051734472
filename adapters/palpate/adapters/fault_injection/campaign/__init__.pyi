from .campaign import cases as cases
from .campaign import run_cases as run_cases
from .runs import Class as Class
from .runs import FaultRun as FaultRun
from .table import as_csv as as_csv
from .table import summary as summary
from .table import table as table
