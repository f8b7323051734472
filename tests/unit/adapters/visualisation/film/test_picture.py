"""Whole pictures, where a graphics library is there to draw them."""

import numpy as np

from palpate.adapters.log.reader import read_log
from palpate.adapters.mujoco.arrows import ACTION, FORCE
from palpate.adapters.visualisation.film import Painter, course_of
from tests.unit.adapters.visualisation.film.trials import INSERTION, require_graphics


def test_arrows_and_inset_are_in_the_picture() -> None:
    require_graphics()
    log = read_log(INSERTION)
    course = course_of(log)
    free, pressing = course.moments[25], course.moments[80]
    with Painter(log, course, (320, 240), "close-up") as painter:
        bare = np.array(painter.paint(pressing))
    with Painter(log, course, (320, 240), "both") as painter:
        there, again, before = (np.array(painter.paint(moment)) for moment in (pressing, pressing, free))
        last = np.array(painter.paint(course.moments[-1]))
    assert there.shape == (240, 320, 3)
    assert (there == again).all()

    def coloured(picture: np.ndarray, colour: tuple[int, int, int]) -> int:
        # Besides the text at the left, and the scale below.
        part = picture[95:200, 120:].astype(int)
        return int((np.abs(part - colour).max(axis=2) < 30).sum())

    assert coloured(there, FORCE) > 100 > 20 > coloured(before, FORCE)
    # The omniscient policy's moves are no compass steps: nothing to draw.
    assert coloured(there, ACTION) == 0
    # The inset at the upper right.
    assert np.abs(there[5:90, -100:].astype(int) - bare[5:90, -100:]).mean() > 10.0
    assert np.abs(there[110:190, 120:200].astype(int) - bare[110:190, 120:200]).max() == 0
    assert np.abs(there.astype(int) - last).mean() > 1.0
