"""A recording for Rerun's viewer: the cell, the force, time series, decisions, events and the learning curve."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Self, TypeAlias

import numpy as np
import rerun as rr
from rerun import blueprint

from palpate.adapters.config import RunConfig
from palpate.adapters.log import DecisionEntry, EventEntry, Tare, TickRecord, TrialLog, tare_of
from palpate.adapters.mujoco import Moment
from palpate.adapters.visualisation.live.cell_shapes import CellShapes
from palpate.core.errors import LogError
from palpate.core.policy import PolicyDocument
from palpate.core.ports import SIMULATOR, Validity
from palpate.core.trial import Outcome

_CLOCK: Final = "run clock"
_ARROW_COLOUR: Final = (217, 26, 26)
_SERIES: Final[dict[str, tuple[str, ...]]] = {
    "wrench": ("fx_N", "fy_N", "fz_N", "tx_Nm", "ty_Nm", "tz_Nm"),
    "tip": ("x_mm", "y_mm", "z_mm"),
    "timing": ("late_ms", "wrench_age_ms"),
    "command": ("altered_mrad",),
}
"""Time series: the tared wrench in the sensor's frame; the tip in the task frame; how late a tick began and how old its
wrench was; and by how much the applied command differs from the commanded one."""
_POSE_TICKS: Final = 5
"""Ticks between two poses: 28 poses a second."""
_FLUSH_TICKS: Final = 14
"""Time series are sent together, ten times a second."""
_MEAN_TICKS: Final = 5
"""The force arrow is a mean over this many ticks; the noise of single samples would make it flicker."""
_MOST_TRIALS: Final = 1000
_NO_TARE: Final = Tare((0.0,) * 6, "nothing")
_NO_WRENCH: Final = (float("nan"),) * 6
_SUPERVISOR: Final = {"clamp": "clamps the command", "trip": "retracts the tool"}

Row: TypeAlias = tuple[float, ...]


class Recording:
    """What a viewer of Rerun's is shown of trial after trial. A context manager."""

    def __init__(self, stream: rr.RecordingStream) -> None:
        self._recording = stream
        self._times_s: list[float] = []
        self._log: TrialLog | None = None
        self._cell: CellShapes | None = None
        self._values: dict[str, dict[str, float]] = {}
        self._tare = _NO_TARE
        self._wrenches: deque[Row] = deque(maxlen=_MEAN_TICKS)
        self._rows: dict[str, tuple[list[int], list[Row]]] = {topic: ([], []) for topic in _SERIES}
        # The wall clock says nothing about the run.
        stream.set_log_time_enabled(False)
        stream.set_log_tick_enabled(False)
        for topic, names in _SERIES.items():
            stream.log(topic, rr.SeriesLines(names=list(names)), static=True)
        stream.log("cell", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)

    @classmethod
    def file(cls, path: Path) -> Self:
        """Write a file that does not exist yet."""
        recording = rr.RecordingStream("palpate", recording_id=path.stem, send_properties=False)
        recording.save(path, default_blueprint=layout())
        return cls(recording)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._recording.flush()
        self._recording.disconnect()

    def begin(self, log: TrialLog, time_ns: int, values: dict[str, dict[str, float]]) -> None:
        """Show the cell of a trial; ``values`` are those of each action in each state."""
        self._log, self._cell, self._values, self._tare = log, None, values, _NO_TARE
        self._wrenches.clear()
        start = log.start
        self._at(time_ns)
        self._event(f"trial {start.number} begins: {start.policy or start.arm}")
        self._supervisor("passes the command")
        try:
            self._cell = CellShapes(log)
        except LogError as error:
            self._event(str(error), serious=True)
            return
        for frame, shapes in self._cell.shapes.items():
            for name, shape in shapes.items():
                self._recording.log(f"cell/{frame}/{name}", shape)

    def tick(self, record: TickRecord) -> None:
        """Show a tick; its time series wait for the flush."""
        time_ns = record.deadline_ns if record.time_ns is None else record.time_ns
        if self._log is None or time_ns is None:
            return
        self._at(time_ns)
        wrench = self._tare.taken_from(record.wrench)
        if wrench is None:
            self._wrenches.clear()
        else:
            self._wrenches.append(wrench)
            self._add("wrench", time_ns, wrench)
        if record.time_ns is not None and record.deadline_ns is not None and record.wrench is not None:
            late, age = record.time_ns - record.deadline_ns, record.time_ns - record.wrench.receive_time_ns
            self._add("timing", time_ns, (late * 1e-6, age * 1e-6))
        if record.asked_rad is not None and record.applied is not None:
            pairs = zip(record.asked_rad, record.applied.position_rad, strict=True)
            self._add("command", time_ns, (max(abs(a - b) for a, b in pairs) * 1e3,))
        if record.joints is not None and record.joints.validity is not Validity.INVALID:
            if not record.tick % _POSE_TICKS:
                self._pose(record.tick, time_ns, record.joints.position_rad)
        if not record.tick % _FLUSH_TICKS:
            self._flush()

    def event(self, entry: EventEntry) -> None:
        """Show an event of the trial, at the time of the newest tick."""
        if self._log is None:
            return
        self._log.events.append(entry)
        if entry.name == "tare":
            self._tare = tare_of(self._log, [])
        state = _SUPERVISOR.get(entry.name)
        if state is not None:
            self._supervisor(f"{state}: {entry.detail}")
        self._event(f"{entry.name}: {entry.detail}".rstrip(": "), serious=state is not None)

    def decision(self, entry: DecisionEntry) -> None:
        """Show an action, and what the actions of its state were worth as the trial began."""
        if self._log is None:
            return
        self._log.decisions.append(entry)
        values = self._values.get(entry.state, {})
        text = f"{entry.number}: **{entry.action}** in {entry.state}, symbol {entry.symbol}, {entry.source}"
        if values:
            text += "\n\n" + ", ".join(f"{action} {value:.3f}" for action, value in values.items())
            self._recording.log("action_values", rr.BarChart(list(values.values())))
        self._recording.log("decision", rr.TextDocument(text, media_type="text/markdown"))

    def end(self) -> None:
        """Show the outcome of a trial, and the learning curve."""
        self._flush()
        if self._log is None or self._log.end is None:
            return
        start, end = self._log.start, self._log.end
        if end.outcome == Outcome.TRIPPED.value:
            self._supervisor("ready for the next trial" if start.world == SIMULATOR else "latched until acknowledged")
        failed = end.error or end.stopped_by
        self._event(f"trial {start.number} is over: {failed or end.outcome}", serious=bool(failed))
        if not failed and end.outcome not in ("", Outcome.INTERRUPTED.value):
            self._times_s.append(end.exploration_time_s)
            # Rerun draws lines over time only: one bar for each trial.
            self._recording.log("learning_curve", rr.BarChart(self._times_s[-_MOST_TRIALS:]))

    def _pose(self, tick: int, time_ns: int, joints_rad: Row) -> None:
        if self._cell is None or self._log is None:
            return
        fx, fy, fz, tx, ty, tz = np.mean(self._wrenches, axis=0).tolist() if self._wrenches else _NO_WRENCH
        # Before the tare the arrow would show the tool's weight.
        known = bool(self._wrenches) and any(self._tare.bias)
        force, torque = ((fx, fy, fz), (tx, ty, tz)) if known else (None, None)
        frames, arrow, tip_mm = self._cell.at(Moment(tick, 0.0, joints_rad, force, torque, "", None))
        for name, (position_m, (w, x, y, z)) in frames.items():
            self._recording.log(f"cell/{name}", rr.Transform3D(translation=position_m, quaternion=(x, y, z, w)))
        origins, vectors = ([], []) if arrow is None else ([arrow[0]], [arrow[1]])
        self._recording.log(
            "cell/base/force", rr.Arrows3D(origins=origins, vectors=vectors, colors=_ARROW_COLOUR, radii=0.002)
        )
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
                self._recording.send_columns(topic, index, columns)
                self._rows[topic] = [], []

    def _supervisor(self, text: str) -> None:
        self._recording.log("supervisor", rr.TextDocument(text))

    def _event(self, text: str, *, serious: bool = False) -> None:
        self._recording.log("log", rr.TextLog(text, level="WARN" if serious else "INFO"))

    def _at(self, time_ns: int) -> None:
        self._recording.set_time(_CLOCK, duration=np.timedelta64(time_ns, "ns"))


def layout() -> blueprint.Blueprint:
    """Return which views the viewer shows where."""
    goal = RunConfig().task.goal
    x_m, y_m, z_m = goal.x_mm * 1e-3, goal.y_mm * 1e-3, goal.z_mm * 1e-3 + 0.1
    eye = blueprint.EyeControls3D(position=(x_m + 0.5, y_m + 0.7, z_m + 0.25), look_target=(x_m - 0.1, y_m, z_m))
    plots = [
        blueprint.TimeSeriesView(name="Force (N), torque (N m)", origin="/wrench"),
        blueprint.TimeSeriesView(name="Tip (mm)", origin="/tip"),
        blueprint.TimeSeriesView(name="Lateness (ms)", origin="/timing"),
    ]
    return blueprint.Blueprint(
        blueprint.Horizontal(
            blueprint.Vertical(
                blueprint.Spatial3DView(name="Cell", origin="/cell", eye_controls=eye),
                blueprint.TextLogView(name="Events", origin="/log"),
                row_shares=[3, 1],
            ),
            blueprint.Vertical(*plots),
            blueprint.Vertical(
                blueprint.BarChartView(name="Action values of the state", origin="/action_values"),
                blueprint.TextDocumentView(name="Decision", origin="/decision"),
                blueprint.TextDocumentView(name="Supervisor", origin="/supervisor"),
                blueprint.BarChartView(name="Exploration time of each trial (s)", origin="/learning_curve"),
            ),
            column_shares=[2, 2, 1],
        ),
        blueprint.TimePanel(timeline=_CLOCK, state="collapsed"),
        collapse_panels=True,
    )


def values_in(policy: PolicyDocument | None, state: Mapping[str, Any] | None) -> dict[str, dict[str, float]]:
    """Return the value of each action in each state; empty for a policy without such a table.

    Args:
        state: Of its learner; None takes the one in the policy's document.
    """
    if policy is None:
        return {}
    if state is None:
        state = {} if policy.learner is None else policy.learner.state
    actions = [action.name for action in policy.actions]
    return {
        name: dict(zip(actions, map(float, row), strict=True))
        for name, row in zip(policy.states, state.get("q", ()), strict=False)
        if len(row) == len(actions)
    }
