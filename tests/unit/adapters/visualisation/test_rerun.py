"""What Rerun's own reader finds of trials that were watched while they ran."""

import os
import signal
import socket
from dataclasses import replace

import mujoco
import numpy as np
import pytest
import rerun as rr

from palpate.adapters.config import scenario
from palpate.adapters.experiments import Run
from palpate.adapters.log import read_log, series_of
from palpate.adapters.mujoco import DrawnCell
from palpate.adapters.visualisation.live import LiveView, view
from palpate.adapters.visualisation.live.view import CellShapes
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


def test_a_trial_that_is_watched_is_the_same_and_shows_what_its_log_holds(tmp_path):
    job, watched, alone = scenario("paper"), tmp_path / "watched", tmp_path / "alone"
    stream = rr.RecordingStream("palpate", send_properties=False)
    stream.save(tmp_path / "live.rrd")
    with LiveView(stream) as view:
        Run(job, live=view).evaluate(1, "torque", watched)
    Run(job).evaluate(1, "torque", alone)
    log, other = (read_log(folder / "logs" / "trial-00000.mcap") for folder in (watched, alone))
    records = list(log.records())
    assert records == list(other.records())
    series, live = series_of(log), tmp_path / "live.rrd"
    tared_ns = records[next(event.tick for event in log.events if event.name == "tare")].time_ns
    shown = [row for time_ns, row in columns(live, "/wrench", "Scalars:scalars") if time_ns > tared_ns]
    measured = series.wrench[-len(shown) :]
    np.testing.assert_allclose(shown, measured, atol=1e-9)
    tips = [row for _, row in columns(live, "/tip", "Scalars:scalars")]
    np.testing.assert_allclose(tips, series.tip_mm[::5], atol=1e-6)
    assert any("tare" in row[0] for _, row in columns(live, "/log", "TextLog:text"))
    assert len(columns(live, "/decision", "TextDocument:text")) == len(log.decisions) > 0
    assert len(columns(live, "/learning_curve", "BarChart:values")) == 1


def test_a_port_that_is_taken_is_refused_in_one_line():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        with pytest.raises(ConfigurationError, match=r"^live_port must be .*Address already in use.*--live-port"):
            LiveView.serving(taken.getsockname()[1])


def test_a_server_that_hangs_is_ended_before_its_queue_blocks_the_loop(monkeypatch, capsys):
    monkeypatch.setattr(view, "_FLUSH_S", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with LiveView.serving(port) as watched:
        os.kill(watched._server.pid, signal.SIGSTOP)
        # Random, because equal points are compressed into what a socket holds.
        for _ in range(100):
            watched._stream.log("cell/x", rr.Points3D(np.random.default_rng(0).random((10_000, 3))))
        assert watched._server.wait(30) == -signal.SIGKILL
    assert capsys.readouterr().err.count("takes no data") == 1
