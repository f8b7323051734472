"""A recorded trial as a film: its moments, what is written into them, whole pictures, and files."""

from dataclasses import replace

import av
import numpy as np
import pytest
from PIL import Image

from palpate.adapters.log import DecisionEntry, EventEntry, read_log
from palpate.adapters.mujoco import ACTION, FORCE, Moment
from palpate.adapters.visualisation.film import Painter, require_video
from palpate.adapters.visualisation.film.course import FORCE_TICKS, course_of
from palpate.adapters.visualisation.film.picture import now_text, write
from palpate.core.errors import UsageError
from palpate.core.ports import JointSample, Validity, WrenchSample
from tests.support.graphics import INSERTION, require_graphics
from tests.unit.adapters.log.made_logs import POSTURE, tick, write_log

DECISION = DecisionEntry(tick=3, number=0, symbol="x+ y0", state="seen", action="-x", source="learned")
MOMENT = Moment(7, 1.234, POSTURE, (0.0, 0.0, -5.0), (0.0, 0.0, 0.0), "explore", DECISION)


def test_picture_shows_time_phase_symbol_state_action_and_force():
    assert now_text(MOMENT, (0.04, -0.04, -5.06)).splitlines() == [
        "time   1.23 s", "phase  explore", "symbol x+ y0", "state  seen", "action -x (learned)", "force  5.1 N",
        "x y z  +0.0 +0.0 -5.1 N",
    ]  # fmt: skip


@pytest.mark.parametrize("size", [(120, 120), (640, 480), (320, 900), (1920, 1080)])
def test_text_fits_into_a_picture_of_any_size(size):
    picture = Image.new("RGB", size, (0, 0, 0))
    longest = Moment(7, 99.99, POSTURE, None, None, "approach", DECISION)
    write(picture, (0.03, 0.03), now_text(longest, (-11.1, -22.2, -33.3)), "la")
    pixels = np.array(picture).sum(axis=2)
    assert pixels[2:, 2:].any()
    assert not pixels[-1].any()
    assert not pixels[:, -1].any()


def course(path, ticks, *others):
    return course_of(read_log(write_log(path / "a.mcap", ticks, others=others)))


def decision(at, action):
    return DecisionEntry(tick=at, number=at, symbol="s", state="q", action=action, source="learned")


def test_phases_and_actions_run_until_the_next(tmp_path):
    trial = course(
        tmp_path,
        [tick(k) for k in range(40)],
        EventEntry(tick=5, name="phase", detail="approach"),
        EventEntry(tick=10, name="phase", detail="explore"),
        decision(12, "-x"),
        decision(26, "+y"),
        EventEntry(tick=31, name="phase", detail="insert"),
    )
    phases = [moment.phase for moment in trial.moments]
    assert phases == ["lift"] * 5 + ["approach"] * 5 + ["explore"] * 21 + ["insert"] * 9
    actions = [moment.decision.action if moment.decision else "" for moment in trial.moments]
    assert actions == [""] * 12 + ["-x"] * 14 + ["+y"] * 5 + [""] * 9
    assert trial.duration_s == pytest.approx(39 / 140, abs=1e-6)


def test_forces_are_tared_means_over_the_last_ticks(tmp_path):
    tare = EventEntry(tick=0, name="tare", detail="0.5 -1 2.5 N, 0.01 0.02 0.03 N m, sensor frame")
    trial = course(tmp_path, [tick(k) for k in range(20)], tare)
    assert trial.tared
    assert trial.moments[0].force_N == pytest.approx((-0.5, 0.0, 0.5))
    mean = np.mean([0.1 * k for k in range(20 - FORCE_TICKS, 20)])
    assert trial.moments[-1].force_N == pytest.approx((mean - 0.5, 0.0, 0.5))
    assert trial.moments[-1].torque_Nm == pytest.approx((0.0, 0.0, 0.0))


def test_invalid_samples_are_not_drawn(tmp_path):
    nan = float("nan")
    bad_wrench = WrenchSample((nan,) * 3, (nan,) * 3, 0, 0, 5, Validity.INVALID)
    bad_joints = JointSample((nan,) * 6, 0, 0, 5, Validity.INVALID)
    ticks = [tick(k) for k in range(10)]
    ticks[5] = replace(ticks[5], wrench=bad_wrench, joints=bad_joints)
    trial = course(tmp_path, ticks)
    assert trial.moments[5].force_N is None
    assert trial.moments[5].joints_rad == trial.moments[4].joints_rad
    # No mean over the gap.
    assert trial.moments[6].force_N == pytest.approx((0.6, -1.0, 3.0))


@pytest.fixture(scope="module")
def recorded():
    return course_of(read_log(INSERTION))


def test_film_shows_each_time_the_newest_tick(recorded):
    moments = recorded.film(0.0, recorded.duration_s, 20.0, 1.0, 1000)
    assert [moment.tick for moment in moments[:4]] == [0, 7, 14, 21]
    # The last tick is always there, whether or not its time is due.
    assert moments[-1] is recorded.moments[-1]


def test_pyav_without_the_encoder_is_refused(monkeypatch):
    monkeypatch.setattr(av, "codecs_available", {"mpeg4"})
    with pytest.raises(UsageError, match="libx264"):
        require_video()


def test_arrows_and_inset_are_in_the_picture():
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

    def coloured(picture, colour):
        # Besides the text at the left, and the scale below.
        part = picture[95:200, 120:].astype(int)
        return int((np.abs(part - colour).max(axis=2) < 30).sum())

    assert coloured(there, FORCE) > 100 > 20 > coloured(before, FORCE)
    # The oracle policy's moves are no compass steps: nothing to draw.
    assert coloured(there, ACTION) == 0
    # The inset at the upper right.
    assert np.abs(there[5:90, -100:].astype(int) - bare[5:90, -100:]).mean() > 10.0
    assert np.abs(there[110:190, 120:200].astype(int) - bare[110:190, 120:200]).max() == 0
    assert np.abs(there.astype(int) - last).mean() > 1.0
