from .page import PAGE as PAGE
from .page import html_of as html_of
from .page import require_free as require_free
from .run_page import run_page as run_page
from .study_page import study_page as study_page
