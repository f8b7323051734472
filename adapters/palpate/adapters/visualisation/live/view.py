"""Live display of trials in Rerun's viewer, fed by an observer of the control loop."""

from __future__ import annotations

import ctypes
import os
import signal
import socket
import subprocess
import sys
import threading
from collections import deque
from dataclasses import replace
from typing import Any, Final, Self, TypeAlias

import mujoco
import numpy as np
import rerun as rr
import rerun_cli
from rerun import blueprint
from typing_extensions import override

from palpate.adapters.config import with_options
from palpate.adapters.experiments import Trials, TrialsObserver, outcome_of
from palpate.adapters.log import EventEntry, StartRecord, Tare, TrialLog, dump_json, start_facts, tare_of, world_of
from palpate.adapters.mujoco import DrawnCell, Moment
from palpate.core.errors import ConfigurationError, LogError
from palpate.core.ports import AppliedCommand, JointCommand, Snapshot, Validity
from palpate.core.trial import Outcome, TrialReport

PORT: Final = 9876
"""Default port of Rerun's viewer."""
_MEMORY: Final = "512MB"
"""Memory limit for the server, for viewers that connect late. Beyond it, the oldest data are dropped."""
_CLOCK: Final = "run clock"
_SERIES: Final[dict[str, tuple[str, ...]]] = {
    "wrench": ("fx_N", "fy_N", "fz_N", "tx_Nm", "ty_Nm", "tz_Nm"),
    "tip": ("x_mm", "y_mm", "z_mm"),
    "timing": ("late_ms", "wrench_age_ms"),
}
"""Time series: the tared wrench in the sensor frame, the tip in the task frame, the delay of each tick, and the age of
its wrench."""
_POSE_TICKS: Final = 5
"""Ticks between two poses, which corresponds to 28 poses per second."""
_FLUSH_TICKS: Final = 14
"""Ticks between two transmissions of time series, which corresponds to ten per second."""
_FLUSH_S: Final = 5.0
"""Time limit for transmissions to the server, and interval between checks; without it, a full queue blocks the loop."""
_MEAN_TICKS: Final = 5
"""Number of ticks averaged for the force arrow, which would otherwise flicker because of sample noise."""
_MOST_TRIALS: Final = 1000
_SPHERES_OF_CONTACT: Final = 3
"""Group of the peg's contact spheres, which are too small to be visible."""
_M_PER_N: Final = 0.015
"""Length of the force arrow per newton."""
_NO_TARE: Final = Tare((0.0,) * 6, "nothing")
Row: TypeAlias = tuple[float, ...]


class LiveView(TrialsObserver):
    """Live view of trials, with a Rerun recording stream and a server, both of which end when the context exits."""

    def __init__(self, stream: rr.RecordingStream, server: subprocess.Popen[bytes] | None = None, address: str = ""):
        self._stream, self._server, self.address = stream, server, address
        self._over = threading.Event()
        self._monitor = threading.Thread(target=self._check_server, daemon=True)
        self._trials: Trials | None = None
        self._log: TrialLog | None = None
        self._report: TrialReport | None = None
        self._cell: CellShapes | None = None
        self._tare, self._times_s = _NO_TARE, list[float]()
        self._events = self._decisions = self._deadline_ns = 0
        self._wrenches: deque[Row] = deque(maxlen=_MEAN_TICKS)
        self._rows: dict[str, tuple[list[int], list[Row]]] = {topic: ([], []) for topic in _SERIES}
        # Wall-clock times have no meaning for the run.
        stream.set_log_time_enabled(False)
        stream.set_log_tick_enabled(False)
        for topic, names in _SERIES.items():
            stream.log(topic, rr.SeriesLines(names=list(names)), static=True)
        stream.log("cell", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)

    @classmethod
    def serving(cls, port: int = 0) -> Self:
        """Serve viewers on this computer.

        Raises:
            ConfigurationError: The port is in use.
        """
        port = port or PORT
        try:
            with socket.socket() as tried:
                tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                tried.bind(("127.0.0.1", port))
        except OSError as error:
            accepted = f"a free port ({error.strerror}); --live-port chooses another"
            raise ConfigurationError("live_port", port, accepted) from error
        # A recording's own server listens on every address; Rerun's program accepts one address.
        program = next(iter(rerun_cli.__path__)) + "/rerun"
        words = ["--serve-grpc", "--bind", "127.0.0.1", "--port", str(port), "--server-memory-limit", _MEMORY]
        quiet = subprocess.DEVNULL
        server = subprocess.Popen(
            [program, *words], stdin=quiet, stdout=quiet, stderr=quiet, preexec_fn=_end_with_parent,
            # With CI set, Rerun sends no usage statistics.
            env={**os.environ, "CI": "1"},
        )  # fmt: skip
        stream, address = rr.RecordingStream("palpate"), f"rerun+http://127.0.0.1:{port}/proxy"
        stream.connect_grpc(address, default_blueprint=_layout())
        return cls(stream, server, address)

    def __enter__(self) -> Self:
        self._monitor.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._over.set()
        self._monitor.join()
        # The server is stopped first, because disconnecting waits for it without a limit.
        if self._server is not None:
            self._server.kill()
            self._server.wait()
        self._stream.disconnect()

    def _check_server(self) -> None:
        """Until the view ends, kill the server if it takes no data; the remaining data are then discarded at once."""
        is_over = False
        while not is_over:
            is_over = self._over.wait(_FLUSH_S)
            try:
                self._stream.flush(timeout_sec=_FLUSH_S)
            except (RuntimeError, ValueError):
                is_over = True
                sys.stderr.write("palpate: live view: Rerun's server takes no data, and the view has ended\n")
                if self._server is not None:
                    self._server.kill()

    @override
    def of(self, trials: Trials) -> None:
        self._trials = trials

    @override
    def begun(self, start_ns: int, report: TrialReport) -> None:
        trials = self._trials
        if trials is None:
            return
        self._report, self._cell, self._tare, self._events, self._decisions = report, None, _NO_TARE, 0, 0
        self._wrenches.clear()
        self._at(start_ns)
        self._notify(f"trial {report.setup.index - trials.first} begins: {trials.name or trials.config.arm}")
        # A trial log with the data that describe its cell.
        world, setup = world_of(trials.rig), report.setup
        start = StartRecord(
            **start_facts("live", with_options(trials.config), trials.ready, trials.perception), seed=setup.seed,
            trial=setup.index, start_m=setup.start_m, policy=trials.name, world=world.kind,
            world_json=dump_json(world.facts),
        )  # fmt: skip
        self._log = TrialLog("live view", 0, start)
        try:
            self._cell = CellShapes(self._log)
        except LogError as error:
            self._notify(str(error), serious=True)
            return
        for frame, shapes in self._cell.shapes.items():
            for name, shape in shapes.items():
                self._stream.log(f"cell/{frame}/{name}", shape)

    @override
    def waited(self, tick: int, deadline_ns: int) -> None:
        self._deadline_ns = deadline_ns

    @override
    def sent(self, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> None:
        time_ns, sample = snapshot.time_ns, snapshot.wrench
        self._at(time_ns)
        wrench = self._tare.taken_from(sample)
        if wrench is None:
            self._wrenches.clear()
        else:
            self._wrenches.append(wrench)
            self._add("wrench", time_ns, wrench)
        late, age = time_ns - self._deadline_ns, time_ns - sample.receive_time_ns
        self._add("timing", time_ns, (late * 1e-6, age * 1e-6))
        if snapshot.joints.validity is not Validity.INVALID and not snapshot.tick % _POSE_TICKS:
            self._pose(snapshot.tick, time_ns, snapshot.joints.position_rad)
        if not snapshot.tick % _FLUSH_TICKS:
            self._flush()
        self._follow()

    @override
    def stopped(self, error: BaseException | None) -> None:
        report = self._report
        if report is None:
            return
        self._follow()
        self._flush()
        outcome = outcome_of(report)
        self._notify(f"trial is over: {error or ('' if outcome is None else outcome.value)}", serious=error is not None)
        if error is None and outcome not in (None, Outcome.INTERRUPTED):
            self._times_s.append(report.exploration_time_s)
            # Rerun draws lines only over time, so each trial is a bar.
            self._stream.log("learning_curve", rr.BarChart(self._times_s[-_MOST_TRIALS:]))
        self._report = None

    def _follow(self) -> None:
        """Show new report entries."""
        report = self._report
        if report is None:
            return
        for event in report.events[self._events :]:
            if event.name == "tare" and self._log is not None:
                self._log.events.append(EventEntry(tick=event.tick, name=event.name, detail=event.detail))
                self._tare = tare_of(self._log)
            self._notify(f"{event.name}: {event.detail}".rstrip(": "), serious=event.name in ("clamp", "trip"))
        for number, one in enumerate(report.decisions[self._decisions :], start=self._decisions):
            text = f"{number}: **{one.action}** in {one.state}, symbol {one.symbol}, {one.source}"
            self._stream.log("decision", rr.TextDocument(text, media_type="text/markdown"))
        self._events, self._decisions = len(report.events), len(report.decisions)

    def _pose(self, tick: int, time_ns: int, joints_rad: Row) -> None:
        if self._cell is None:
            return
        force, torque = None, None
        # Before the tare the arrow would show the tool's weight.
        if self._wrenches and any(self._tare.bias):
            fx, fy, fz, tx, ty, tz = np.mean(self._wrenches, axis=0).tolist()
            force, torque = (fx, fy, fz), (tx, ty, tz)
        frames, arrow, tip_mm = self._cell.at(Moment(tick, 0.0, joints_rad, force, torque, "", None))
        for name, (position_m, (w, x, y, z)) in frames.items():
            self._stream.log(f"cell/{name}", rr.Transform3D(translation=position_m, quaternion=(x, y, z, w)))
        origins, vectors = ([], []) if arrow is None else ([arrow[0]], [arrow[1]])
        shown = rr.Arrows3D(origins=origins, vectors=vectors, colors=(217, 26, 26), radii=0.002)
        self._stream.log("cell/base/force", shown)
        self._add("tip", time_ns, tip_mm)

    def _add(self, topic: str, time_ns: int, row: Row) -> None:
        times_ns, rows = self._rows[topic]
        times_ns.append(time_ns)
        rows.append(row)

    def _flush(self) -> None:
        for topic, (times_ns, rows) in self._rows.items():
            if rows:
                columns = rr.Scalars.columns(scalars=np.array(rows).ravel()).partition([len(rows[0])] * len(rows))
                index = [rr.TimeColumn(_CLOCK, duration=np.array(times_ns, "timedelta64[ns]"))]
                self._stream.send_columns(topic, index, columns)
                self._rows[topic] = [], []

    def _notify(self, text: str, *, serious: bool = False) -> None:
        self._stream.log("log", rr.TextLog(text, level="WARN" if serious else "INFO"))

    def _at(self, time_ns: int) -> None:
        self._stream.set_time(_CLOCK, duration=np.timedelta64(time_ns, "ns"))


class CellShapes:
    """Cell geometry: the shapes in each frame, by frame name.

    Raises:
        LogError: The log does not describe the cell completely.
    """

    def __init__(self, log: TrialLog) -> None:
        self._cell = DrawnCell(log)
        model = self._cell.model
        self._names = ["base", *(str(model.body(body).name) for body in range(1, model.nbody))]
        self._task_in_base = self._cell.goal_in_base.inverse()
        self.shapes: dict[str, dict[str, Any]] = {name: {} for name in self._names}
        for geom in range(model.ngeom):
            shape = None if int(model.geom_group[geom]) == _SPHERES_OF_CONTACT else _shape(model, geom)
            if shape is not None:
                self.shapes[self._names[int(model.geom_bodyid[geom])]][f"shape_{geom}"] = shape

    def at(self, moment: Moment) -> tuple[dict[str, tuple[Row, Row]], tuple[Row, Row] | None, Row]:
        """Return the frames, the force arrow and the tip at a given time.

        Returns:
            Position (3,) in m and quaternion (w, x, y, z) of each frame, and origin and vector of the force arrow in m,
            all in the base frame; and the tip from the encoders, (3,) in mm in the task frame.
        """
        cell = self._cell
        # From the encoders, which do not measure the gripper's deflection.
        cell.pose(replace(moment, force_N=None, torque_Nm=None))
        tip_mm = tuple((self._task_in_base.act(cell.tip_m) * 1e3).tolist())
        cell.pose(moment)
        positions, turns = cell.data.xpos.tolist(), cell.data.xquat.tolist()
        frames = {name: (positions[body], turns[body]) for body, name in enumerate(self._names) if body}
        tip, force = cell.tip_m, cell.force_in_base(moment)
        arrow = None
        if force is not None:
            # The arrow ends at its point of action; otherwise it would lie within the peg.
            vector = force * _M_PER_N
            arrow = tuple((tip - vector).tolist()), tuple(vector.tolist())
        return frames, arrow, tip_mm


def _shape(model: mujoco.MjModel, geom: int) -> Any:
    a, b, c = model.geom_size[geom].tolist()
    w, x, y, z = model.geom_quat[geom].tolist()
    colour = tuple(round(255 * part) for part in model.geom_rgba[geom].tolist())
    solid: dict[str, Any] = {"colors": colour, "quaternions": [(x, y, z, w)], "fill_mode": "solid"}
    centre = [model.geom_pos[geom].tolist()]
    match int(model.geom_type[geom]):
        case mujoco.mjtGeom.mjGEOM_BOX:
            return rr.Boxes3D(half_sizes=[(a, b, c)], centers=centre, **solid)
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            return rr.Ellipsoids3D(half_sizes=[(a, a, a)], centers=centre, **solid)
        case mujoco.mjtGeom.mjGEOM_CYLINDER | mujoco.mjtGeom.mjGEOM_CAPSULE:
            return rr.Cylinders3D(lengths=[2 * b], radii=[a], centers=centre, **solid)
        case mujoco.mjtGeom.mjGEOM_MESH:
            turn = np.empty(9)
            mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
            corners = model.geom_pos[geom] + model.mesh_vert[model.mesh_face.ravel()] @ turn.reshape(3, 3).T
            return rr.Mesh3D(vertex_positions=corners, albedo_factor=colour)
    return None


def _layout() -> blueprint.Blueprint:
    """Return the viewer's layout."""
    return blueprint.Blueprint(
        blueprint.Horizontal(
            blueprint.Vertical(
                blueprint.Spatial3DView(name="Cell", origin="/cell"),
                blueprint.TextLogView(name="Events", origin="/log"),
                row_shares=[3, 1],
            ),
            blueprint.Vertical(
                blueprint.TimeSeriesView(name="Force (N), torque (N m)", origin="/wrench"),
                blueprint.TimeSeriesView(name="Tip (mm)", origin="/tip"),
                blueprint.TimeSeriesView(name="Lateness (ms)", origin="/timing"),
            ),
            blueprint.Vertical(
                blueprint.TextDocumentView(name="Decision", origin="/decision"),
                blueprint.BarChartView(name="Exploration time of each trial (s)", origin="/learning_curve"),
            ),
            column_shares=[2, 2, 1],
        ),
        blueprint.TimePanel(timeline=_CLOCK, state="collapsed"),
        collapse_panels=True,
    )


def _end_with_parent() -> None:
    set_death_signal = 1
    ctypes.CDLL(None).prctl(set_death_signal, signal.SIGKILL)
