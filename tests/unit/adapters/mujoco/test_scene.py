"""The drawn cell: it stands where encoders and sensor say, and appears where it is expected."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.adapters.log import EndRecord, read_log, series_of
from palpate.adapters.mujoco.scene import DrawnCell, Moment, Stage, true_hole_m
from palpate.adapters.visualisation.video.trajectory import trajectory_of
from palpate.core.errors import LogError
from tests.support.graphics import GOLDEN, INSERTION, require_graphics
from tests.unit.adapters.log.made_logs import POSTURE, start, tick, write_log

REST = Moment(0, 0.0, POSTURE, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), "lift", None)


@pytest.fixture(scope="module")
def log():
    return read_log(INSERTION)


@pytest.fixture(scope="module")
def cell(log):
    return DrawnCell(log)


@pytest.mark.parametrize("name", ["oracle-blind.mcap", "torque-ur5.mcap"])
def test_tip_is_where_the_encoders_have_it(name):
    trial = read_log(GOLDEN / name)
    drawn = DrawnCell(trial)
    series = series_of(trial)
    for moment in trajectory_of(trial).moments[::40]:
        drawn.pose(replace(moment, force_N=None, torque_Nm=None))
        tip_mm = drawn.goal_in_base.actInv(drawn.tip_m) * 1e3
        assert tip_mm == pytest.approx(series.tip_mm[moment.tick], abs=1e-3)


def test_measured_force_bends_the_springs(cell):
    cell.pose(REST)
    before = cell.tip_m
    cell.pose(replace(REST, force_N=(0.0, 0.0, -5.0)))
    # 5 N on a spring of 5 N/mm, along the tool, which points down.
    assert cell.tip_m - before == pytest.approx([0.0, 0.0, 1e-3], abs=1e-6)
    force = cell.force_in_base(replace(REST, force_N=(0.0, 0.0, -5.0)))
    assert force == pytest.approx([0.0, 0.0, 5.0], abs=1e-3)
    cell.pose(replace(REST, force_N=(0.0, 0.0, -1e12)))
    assert np.linalg.norm(cell.tip_m - before) < 0.03


def test_at_the_end_of_an_insertion_the_drawn_peg_is_in_the_drawn_hole(log, cell):
    cell.pose(trajectory_of(log).moments[-1])
    down = cell.tip_m - cell.mouth_m
    assert down[2] == pytest.approx(-(log.end.true_depth_m or 0.0), abs=1e-4)
    assert np.abs(down[:2]).max() < 1.5e-4


def test_hole_is_where_it_was_or_where_it_is_believed_to_be(tmp_path):
    def hole(world_json, end=None):
        path = tmp_path / f"{len(list(tmp_path.iterdir()))}.mcap"
        write_log(path, [tick(0)], begin=start(world_json=world_json), end=end)
        return true_hole_m(read_log(path))

    assert hole('{"hole_in_task_m": [0.001, -0.002, 0]}') == (0.001, -0.002, 0.0)
    assert hole("", EndRecord(tick=0, true_hole_in_task_m=(0.0, 0.5, 0.0))) == (0.0, 0.5, 0.0)
    for unknown in ("", "{}", "[1]", "no json", '{"hole_in_task_m": [1, 2]}', '{"hole_in_task_m": ["a", 0, 0]}'):
        assert hole(unknown) is None
    assert hole('{"hole_in_task_m": [NaN, 0, 0]}') is None
    rig = DrawnCell(read_log(write_log(tmp_path / "b.mcap", [tick(0)], begin=start(world="bench"))))
    assert not rig.hole_known
    assert rig.mouth_m == pytest.approx([0.4, 0.0, 0.02])


@pytest.mark.parametrize(
    "wrong", [{"tip_rotation": (1.0, 0.0)}, {"tip_rotation": (float("nan"),) * 9}, {"config_toml": 'arm = "puma"'}]
)
def test_start_that_does_not_tell_the_cell_is_refused(tmp_path, wrong):
    with pytest.raises(LogError, match=r"a\.mcap"):
        DrawnCell(read_log(write_log(tmp_path / "a.mcap", [tick(0)], begin=start(**wrong))))


def test_point_appears_where_the_view_says(cell):
    require_graphics()
    cell.pose(REST)
    close, _ = cell.views()
    stage = Stage(cell, (320, 240))
    try:
        picture = stage.picture(close, 320, 240).astype(int)
    finally:
        stage.close()
    assert picture.shape == (240, 320, 3)
    # The peg is the only thing that is far more red than blue; its lower end is a little in front of the tip.
    rows, columns = np.nonzero(picture[:, :, 0] - picture[:, :, 2] > 60)
    x, y = close.pixel_of(cell.tip_m, 320, 240)
    assert (columns.min() + columns.max()) / 2 == pytest.approx(x, abs=2)
    front = cell.tip_m + np.array([0.0, -cell.peg_diameter_m / 2, 0.0])
    assert rows.max() == pytest.approx(close.pixel_of(front, 320, 240)[1], abs=2)
    assert rows.max() > y
