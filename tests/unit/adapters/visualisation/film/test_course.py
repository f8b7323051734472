"""From a log to the moments that are drawn."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from palpate.adapters.log import DecisionEntry, EventEntry, TickRecord, read_log
from palpate.adapters.visualisation.film.course import FORCE_TICKS, Course, course_of
from palpate.core.errors import LogError
from palpate.core.ports.values import JointSample, Validity, WrenchSample
from tests.unit.adapters.log.made_logs import tick, write_log
from tests.unit.adapters.visualisation.film.trials import INSERTION


def course(path: Path, ticks: list[TickRecord], *others: Any) -> Course:
    return course_of(read_log(write_log(path / "a.mcap", ticks, others=others)))


def decision(at: int, action: str) -> DecisionEntry:
    return DecisionEntry(tick=at, number=at, symbol="s", state="q", action=action, source="learned")


def test_phases_and_actions_run_until_the_next(tmp_path: Path) -> None:
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


def test_forces_are_tared_means_over_the_last_ticks(tmp_path: Path) -> None:
    tare = EventEntry(tick=0, name="tare", detail="0.5 -1 2.5 N, 0.01 0.02 0.03 N m, sensor frame")
    trial = course(tmp_path, [tick(k) for k in range(20)], tare)
    assert trial.tared
    assert trial.moments[0].force_N == pytest.approx((-0.5, 0.0, 0.5))
    mean = np.mean([0.1 * k for k in range(20 - FORCE_TICKS, 20)])
    assert trial.moments[-1].force_N == pytest.approx((mean - 0.5, 0.0, 0.5))
    assert trial.moments[-1].torque_Nm == pytest.approx((0.0, 0.0, 0.0))


def test_without_a_zero_forces_are_raw_and_it_is_known(tmp_path: Path) -> None:
    trial = course(tmp_path, [tick(0)])
    assert not trial.tared
    assert trial.moments[0].force_N == (0.0, -1.0, 3.0)


def test_what_a_device_marked_invalid_is_not_drawn(tmp_path: Path) -> None:
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


def test_the_trial_begins_with_the_first_tick_that_has_joint_angles(tmp_path: Path) -> None:
    ticks = [replace(tick(0), joints=None), replace(tick(1), time_ns=None, deadline_ns=None), tick(2), tick(3)]
    trial = course(tmp_path, ticks)
    assert [moment.tick for moment in trial.moments] == [2, 3]
    assert trial.moments[0].time_s == 0.0


def test_a_log_without_joint_angles_cannot_be_drawn(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="nothing to draw"):
        course(tmp_path, [replace(tick(k), joints=None) for k in range(3)])


@pytest.fixture(scope="module")
def recorded() -> Course:
    return course_of(read_log(INSERTION))


def test_a_film_shows_each_time_the_newest_tick(recorded: Course) -> None:
    moments = recorded.film(0.0, recorded.duration_s, 20.0, 1.0, 1000)
    assert [moment.tick for moment in moments[:4]] == [0, 7, 14, 21]
    # The last tick is always there, whether or not its time is due.
    assert moments[-1] is recorded.moments[-1]


def test_samples_have_the_first_and_the_last_moment(recorded: Course) -> None:
    moments = recorded.spread(0.5, recorded.duration_s, 4)
    assert len(moments) == 4
    assert moments[0].tick == 70
    assert moments[-1] is recorded.moments[-1]
