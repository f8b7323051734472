import numpy as np
import pytest
from PIL import Image

from palpate.adapters.log import DecisionEntry
from palpate.adapters.mujoco.scene import Moment
from palpate.adapters.visualisation.film import captions
from palpate.adapters.visualisation.film.course import Course
from tests.unit.adapters.log.made_logs import POSTURE

DECISION = DecisionEntry(tick=3, number=0, symbol="x+ y0", state="seen", action="-x", source="learned")
MOMENT = Moment(7, 1.234, POSTURE, (0.0, 0.0, -5.0), (0.0, 0.0, 0.0), "explore", DECISION)


def test_a_picture_tells_time_phase_symbol_state_action_and_force() -> None:
    assert captions.now_lines(MOMENT, (0.04, -0.04, -5.06)) == [
        ("time", "1.23 s"), ("phase", "explore"), ("symbol", "x+ y0"), ("state", "seen"), ("action", "-x (learned)"),
        ("force", "5.1 N"), ("x y z", "+0.0 +0.0 -5.1 N"),
    ]  # fmt: skip


def test_what_there_is_not_is_a_dash() -> None:
    bare = Moment(0, 0.0, POSTURE, None, None, "lift", None)
    lines = dict(captions.now_lines(bare, None))
    assert (lines["symbol"], lines["action"], lines["force"], lines["x y z"]) == ("-", "-", "not measured", "-")
    # Pictures of one film have the same number of lines, so that nothing jumps.
    assert len(captions.now_lines(bare, None)) == len(captions.now_lines(MOMENT, (0.0, 0.0, 0.0)))


def test_the_notes_say_whose_hole_it_is_and_whether_the_force_is_raw() -> None:
    tared, raw = Course((MOMENT,), True), Course((MOMENT,), False)
    assert captions.notes_of(tared, hole_known=True, world="simulator") == ["hole: where the simulator had it"]
    assert captions.notes_of(raw, hole_known=False, world="bench") == [
        "hole: where it is believed to be", "force: raw, weight included",
    ]  # fmt: skip


@pytest.mark.parametrize("size", [(120, 120), (640, 480), (320, 900), (1920, 1080)])
def test_the_block_fits_into_a_picture_of_any_size(size: tuple[int, int]) -> None:
    picture = Image.new("RGB", size, (0, 0, 0))
    longest = Moment(7, 99.99, POSTURE, None, None, "approach", DECISION)
    captions.write_block(picture, (2, 2), captions.now_lines(longest, (-11.1, -22.2, -33.3)), captions.font_px(*size))
    pixels = np.array(picture).sum(axis=2)
    assert pixels[2:, 2:].any()
    assert not pixels[-1].any()
    assert not pixels[:, -1].any()


def test_letters_are_dark_on_a_ground_that_is_light_all_round_them() -> None:
    picture = Image.new("RGB", (200, 60), (40, 40, 40))
    captions.write_line(picture, (20, 20), "force", 20)
    pixels = np.array(picture.convert("L"))
    assert pixels[0, 0] == 40
    assert pixels[17:22, 17].max() > 180
    assert pixels[20:44, 20:80].min() < 60
