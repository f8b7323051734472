"""What Rerun's own reader finds of trials: exported logs, and trials that were watched while they ran."""

import socket
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from palpate.adapters.config import scenario
from palpate.adapters.experiments import Run
from palpate.adapters.log import read_log, series_of
from palpate.adapters.mujoco import DrawnCell
from palpate.adapters.visualisation.live import LiveView, export_rerun
from palpate.adapters.visualisation.live.cell_shapes import CellShapes
from palpate.adapters.visualisation.live.recording import Recording
from palpate.core.errors import ConfigurationError
from palpate.core.job import SIDES
from tests.golden.record import HERE as GOLDEN

LOG = GOLDEN / "train-paper.mcap"


def columns(path, entity, name):
    """Return times, ns, and values of a component."""
    from rerun.chunk import RrdReader

    found = []
    for chunk in RrdReader(path).stream().to_chunks():
        if chunk.entity_path == entity and not chunk.is_static:
            batch = chunk.to_record_batch()
            if name in batch.schema.names:
                times_ns = np.array(batch.column("run clock").cast("int64")).tolist()
                found += zip(times_ns, batch.column(name).to_pylist(), strict=True)
    return found


def test_an_exported_log_has_its_wrench_tip_events_and_decisions(tmp_path):
    (made,) = export_rerun([LOG], tmp_path / "out")
    log = read_log(LOG)
    series, records = series_of(log), list(log.records())
    tared = next(event.tick for event in log.events if event.name == "tare")
    after_ns = records[tared].time_ns
    assert after_ns is not None
    shown = [row for time_ns, row in columns(made, "/wrench", "Scalars:scalars") if time_ns > after_ns]
    measured = series.wrench[tared + 1 :]
    np.testing.assert_allclose(shown, measured[np.isfinite(measured).all(axis=1)], atol=1e-9)
    tips = [row for _, row in columns(made, "/tip", "Scalars:scalars")]
    np.testing.assert_allclose(tips, series.tip_mm[::5], atol=1e-6)
    texts = [row[0] for _, row in columns(made, "/log", "TextLog:text")]
    assert any("tare" in text for text in texts)
    assert len(columns(made, "/decision", "TextDocument:text")) == len(log.decisions)
    assert columns(made, "/action_values", "BarChart:values")
    assert len(columns(made, "/learning_curve", "BarChart:values")) == 1


@pytest.mark.parametrize("section", SIDES)
def test_a_peg_that_is_not_round_is_drawn_as_a_mesh_that_fits_the_rim_of_its_hole(section):
    log = read_log(LOG)
    text = log.start.config_toml.replace('"round"', f'"{section}"')
    log = replace(log, start=replace(log.start, config_toml=text))
    drawn = DrawnCell(log)
    (peg,) = CellShapes(log).shapes["peg"].values()
    corners = np.array(peg.vertex_positions.as_arrow_array().to_pylist())
    end_face = corners[np.abs(corners[:, 2]) < 1e-4]
    mujoco.mj_kinematics(drawn.model, drawn.data)
    rim_m = drawn.rim_m(64) - drawn.mouth_m
    widest_m = np.hypot(*end_face[:, :2].T).max()
    assert widest_m == pytest.approx(np.hypot(*rim_m[:, :2].T).max(), rel=0.03)


def test_a_trial_that_is_watched_is_the_same_and_shows_what_its_log_shows(tmp_path):
    job, watched, alone = scenario("paper"), tmp_path / "watched", tmp_path / "alone"
    with LiveView(Recording.file(tmp_path / "live.rrd")) as view:
        Run(job, live=view).evaluate(2, "torque", watched)
    Run(job).evaluate(2, "torque", alone)
    for path in sorted((alone / "logs").glob("*.mcap")):
        assert list(read_log(watched / "logs" / path.name).records()) == list(read_log(path).records())
    exported = export_rerun([watched / "logs" / "trial-00001.mcap"], tmp_path / "out")[0]
    for entity, name in (("/tip", "Scalars:scalars"), ("/decision", "TextDocument:text")):
        live, from_log = columns(tmp_path / "live.rrd", entity, name), columns(exported, entity, name)
        assert live[-len(from_log) :] == from_log
        assert len(live) > len(from_log) > 0
    assert len(columns(tmp_path / "live.rrd", "/learning_curve", "BarChart:values")) == 2


def test_a_port_that_is_taken_is_refused_in_one_line():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(ConfigurationError, match=r"^live_port = \d+ .*Address already in use.*--live-port"):
            LiveView.serving(taken.getsockname()[1])
