"""What a picture of a trial costs beside what the graphics library alone takes."""

from __future__ import annotations

from pathlib import Path
from statistics import median
from time import process_time

import mujoco

from benchmarks.suite.rows import Form, MissingError, Row
from palpate.adapters.log.reader import read_log
from palpate.adapters.mujoco.graphics import working_library
from palpate.adapters.visualisation.film.course import course_of
from palpate.adapters.visualisation.film.picture import Painter
from palpate.core.errors import UsageError

LOG = Path(__file__).parents[2] / "tests" / "golden" / "omniscient-blind.mcap"
SIZE = (640, 480)


def painted(form: Form) -> list[Row]:
    """CPU time of a picture with arrows, text and inset, and of the drawing in it."""
    try:
        library = working_library()
    except UsageError as error:
        raise MissingError(str(error)) from error
    log = read_log(LOG)
    course = course_of(log)
    drawing: list[float] = []
    bare = mujoco.mjr_render

    def timed(*words: object) -> None:
        began = process_time()
        bare(*words)
        drawing[-1] += process_time() - began

    whole = []
    with Painter(log, course, SIZE, "both") as painter:
        painter.paint(course.moments[0])
        mujoco.mjr_render = timed
        try:
            for moment in course.spread(0.0, course.duration_s, 4 * form.rounds):
                drawing.append(0.0)
                began = process_time()
                painter.paint(moment)
                whole.append(process_time() - began)
        finally:
            mujoco.mjr_render = bare
    size = f"{SIZE[0]}x{SIZE[1]}"
    return [Row(f"picture, {size}, {library}", 1e3 * median(whole), "ms", "mjr_render in it", 1e3 * median(drawing))]
