"""A recorded trial as a film: its moments, what is written into them, whole pictures, and files."""

from dataclasses import replace

import av
import numpy as np
import pytest

from palpate.adapters.log import DecisionEntry, EventEntry, read_log
from palpate.adapters.mujoco import Moment
from palpate.adapters.visualisation.video import require_video
from palpate.adapters.visualisation.video.picture import now_text
from palpate.adapters.visualisation.video.trajectory import FORCE_TICKS, trajectory_of
from palpate.core.errors import UsageError
from palpate.core.ports import JointSample, Validity, WrenchSample
from tests.support.graphics import INSERTION
from tests.unit.adapters.log.made_logs import POSTURE, tick, write_log

DECISION = DecisionEntry(tick=3, number=0, symbol="x+ y0", state="seen", action="-x", source="learned")
MOMENT = Moment(7, 1.234, POSTURE, (0.0, 0.0, -5.0), (0.0, 0.0, 0.0), "explore", DECISION)


def test_picture_shows_time_phase_symbol_state_action_and_force():
    assert now_text(MOMENT, (0.04, -0.04, -5.06)).splitlines() == [
        "time   1.23 s", "phase  explore", "symbol x+ y0", "state  seen", "action -x (learned)", "force  5.1 N",
        "x y z  +0.0 +0.0 -5.1 N",
    ]  # fmt: skip


def trajectory(path, ticks, *others):
    return trajectory_of(read_log(write_log(path / "a.mcap", ticks, others=others)))


def decision(at, action):
    return DecisionEntry(tick=at, number=at, symbol="s", state="q", action=action, source="learned")


def test_phases_and_actions_run_until_the_next(tmp_path):
    trial = trajectory(
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
    trial = trajectory(tmp_path, [tick(k) for k in range(20)], tare)
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
    trial = trajectory(tmp_path, ticks)
    assert trial.moments[5].force_N is None
    assert trial.moments[5].joints_rad == trial.moments[4].joints_rad
    # No mean over the gap.
    assert trial.moments[6].force_N == pytest.approx((0.6, -1.0, 3.0))


@pytest.fixture(scope="module")
def recorded():
    return trajectory_of(read_log(INSERTION))


def test_film_shows_each_time_the_newest_tick(recorded):
    moments = recorded.film(0.0, recorded.duration_s, 20.0, 1.0, 1000)
    assert [moment.tick for moment in moments[:4]] == [0, 7, 14, 21]
    # The last tick is always there, whether or not its time is due.
    assert moments[-1] is recorded.moments[-1]


def test_pyav_without_the_encoder_is_refused(monkeypatch):
    monkeypatch.setattr(av, "codecs_available", {"mpeg4"})
    with pytest.raises(UsageError, match="libx264"):
        require_video()
