from .build import kind_of as kind_of
from .build import page_of as page_of
from .placing import FOLDER as FOLDER
from .placing import PAGE as PAGE
from .placing import csv_of as csv_of
from .placing import html_of as html_of
from .placing import place as place
from .placing import require_placeable as require_placeable
