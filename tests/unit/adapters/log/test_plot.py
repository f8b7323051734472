"""A picture of one trial, and the numbers that are drawn in it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from palpate.adapters.config.compose import scenario
from palpate.adapters.log.plot import timeline
from palpate.adapters.log.reader import read_log
from palpate.adapters.log.records import DecisionEntry, EndRecord, EventEntry
from palpate.adapters.log.series import series_of
from palpate.core.errors import LogError
from palpate.core.motion import Kinematics, arm_named
from palpate.core.ports.values import JointSample, Validity, WrenchSample
from palpate.core.trial.frame import goal_in_base
from tests.support.tool import TOOL
from tests.unit.adapters.log.made_logs import POSTURE, start, tick, write_log

TARE = EventEntry(tick=20, name="tare", detail="0.5 -1 2.5 N, 0.01 0.02 -3e-05 N m, sensor frame")


def log(path, ticks, **more):
    return read_log(write_log(path / "a.mcap", ticks, **more))


class Drawn:
    """What was drawn last: panels by the beginning of their label."""

    def __init__(self, monkeypatch):
        save = Figure.savefig

        def keep(figure, *words, **more):
            self.figure = figure
            save(figure, *words, **more)

        monkeypatch.setattr(Figure, "savefig", keep)

    def panel(self, label):
        (found,) = [axes for axes in self.figure.axes if axes.get_ylabel().startswith(label)]
        return found

    @property
    def labels(self):
        return [axes.get_ylabel().split("\n")[0] for axes in self.figure.axes]

    @property
    def texts(self):
        return [text.get_text() for axes in self.figure.axes for text in axes.texts]


@pytest.fixture
def drawn(monkeypatch):
    return Drawn(monkeypatch)


def test_tare_event_is_taken_from_the_wrench(tmp_path):
    trial = log(tmp_path, [tick(k) for k in range(30)], others=[TARE])
    series = series_of(trial)
    assert series.tare.bias == (0.5, -1.0, 2.5, 0.01, 0.02, -3e-05)
    assert "tick 20" in series.tare.origin
    assert series.wrench[4] == pytest.approx([0.4 - 0.5, 0.0, 0.5, 0.0, 0.0, 0.03003])


def test_without_a_tare_event_wrenches_are_raw(tmp_path):
    wrong = EventEntry(tick=20, name="tare", detail="a b c N, d e f N m, sensor frame")
    tare = series_of(log(tmp_path, [tick(k) for k in range(30)], others=[wrong])).tare
    assert tare.bias == (0.0,) * 6
    assert "raw" in tare.origin


def test_tip_is_where_the_kinematics_say_in_the_task_frame(tmp_path):
    series = series_of(log(tmp_path, [tick(0), tick(5)]))
    kinematics = Kinematics(arm_named("zebra-zero"), TOOL)
    goal = goal_in_base(scenario("paper").task.goal)
    for row, number in ((0, 0), (2, 5)):
        kinematics.update(tuple(q + 1e-4 * number for q in POSTURE))
        expected = goal.rotation.T @ (kinematics.tip_position_m - goal.translation)
        assert series.tip_mm[row] == pytest.approx(expected * 1e3, abs=1e-9)
    # The posture is that above the goal, 3 mm up.
    assert series.tip_mm[0] == pytest.approx([0.0, 0.0, -3.0], abs=0.01)


def test_samples_that_are_stale_invalid_or_missing_are_not_drawn(tmp_path):
    nan = WrenchSample((math.nan,) * 3, (0.0,) * 3, 0, 0, 1, Validity.INVALID)
    bad = JointSample((math.nan,) * 6, 0, 0, 2, Validity.INVALID)
    stale = {name: replace(getattr(tick(5), name), validity=Validity.STALE) for name in ("wrench", "joints")}
    ticks = [
        tick(0),
        tick(1, wrench=nan),
        tick(2, joints=bad),
        tick(3, wrench=None, joints=None),
        tick(4, time_ns=None),
        tick(5, **stale),
    ]
    series = series_of(log(tmp_path, ticks))
    assert series.ticks.tolist() == [0, 1, 2, 3, 4, 5]
    assert np.flatnonzero(np.isnan(series.wrench).all(axis=1)).tolist() == [1, 3, 5]
    assert np.flatnonzero(np.isnan(series.tip_mm).all(axis=1)).tolist() == [2, 3, 5]


def test_picture_has_forces_tip_actions_phases_and_events(tmp_path, drawn):
    others = [
        EventEntry(tick=0, name="phase", detail="settle"),
        TARE,
        EventEntry(tick=20, name="phase", detail="explore"),
        EventEntry(tick=20, name="contact", detail="surface"),
        DecisionEntry(tick=30, number=0, symbol="x+ y0", state="x+ y0", action="-x", source="learned"),
        DecisionEntry(tick=44, number=1, symbol="x0 y0", state="x0 y0", action="-x", source="learned"),
        EventEntry(tick=58, name="phase", detail="insert"),
        EventEntry(tick=99, name="hole", detail="found"),
        EventEntry(tick=99, name="end", detail="inserted"),
    ]
    end = EndRecord(tick=99, outcome="inserted", success=True, true_hole_in_task_m=(0.002, -0.001, 0.0))
    trial = log(tmp_path, [tick(k) for k in range(100)], others=others, end=end)
    picture = timeline(trial)
    assert picture.startswith(b"\x89PNG")
    assert drawn.labels == ["force [N]", "torque [N m]", "tip [mm]", "symbol", "action", "phase"]
    series = series_of(trial)
    for label, values in (("force", series.wrench[:, :3]), ("torque", series.wrench[:, 3:])):
        lines = [line.get_ydata() for line in drawn.panel(label).lines[:3]]
        assert np.array_equal(np.array(lines).T, values)
    tip = drawn.panel("tip")
    assert np.array_equal(np.array([line.get_ydata() for line in tip.lines[:3]]).T, series.tip_mm)
    assert [line.get_ydata()[0] for line in tip.lines[3:5]] == [2.0, -1.0]
    assert {"tare, contact", "at depth, end", "settle", "explore", "insert"} <= set(drawn.texts)
    assert [text.get_text() for text in drawn.panel("action").get_yticklabels()] == ["-x"]
    title = drawn.figure.get_suptitle()
    assert "inserted" in title
    assert "tare event at tick 20" in title
    assert "all commands applied as requested" in title


@pytest.mark.parametrize(
    ("ticks", "begin", "complaint"),
    [
        ([], start(), "no tick with a time"),
        ([tick(0, time_ns=None, deadline_ns=None)], start(), "no tick with a time"),
        ([tick(0)], start(config_toml="a = ["), "start.config_toml"),
        ([tick(0)], start(config_toml='arm = "puma"\n'), "start.arm"),
        ([tick(0)], start(config_toml="[task]\nunheard_of = 1\n"), "start.config_toml"),
    ],
)
def test_logs_that_cannot_be_drawn(tmp_path, ticks, begin, complaint):
    with pytest.raises(LogError, match=complaint):
        timeline(log(tmp_path, ticks, begin=begin))
