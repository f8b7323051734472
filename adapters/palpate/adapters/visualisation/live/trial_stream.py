"""The messages of trials, as a log has them, one after the other onto a display."""

import json
from collections import deque
from typing import Any, Final

import mujoco
import numpy as np

from palpate.adapters.log import (
    DECISION,
    END,
    EVENT,
    RECORDER,
    START,
    TICK,
    EndRecord,
    RawMessage,
    StartRecord,
    Tare,
    TrialLog,
    decode_record,
    decode_tick,
    file_in,
    layout_of,
    tare_of,
)
from palpate.adapters.mujoco import DrawnCell, Moment
from palpate.adapters.visualisation.live.display import BASE, SERIES, Display, LearningSoFar, Pose, Row, Shape
from palpate.core.errors import LogError
from palpate.core.ports import SIMULATOR, JointVector, Validity
from palpate.core.trial import Outcome

_KINDS: Final = {
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_MESH): "mesh",
}
_FEELERS: Final = 3
"""Group of the spheres by which the peg touches: too small to be seen."""
_M_PER_N: Final = 0.015
"""Length of the arrow that is drawn for a force."""


class CellFrames:
    """Where everything of a cell is, moment by moment."""

    def __init__(self, log: TrialLog) -> None:
        self._cell = DrawnCell(log)
        model = self._cell.model
        names = [str(model.body(body).name) for body in range(model.nbody)]
        self._names = [BASE, *names[1:]]
        self._task_in_base = self._cell.goal_in_base.inverse()
        self.bodies: dict[str, list[Shape]] = {name: [] for name in self._names}
        for geom in range(model.ngeom):
            kind = _KINDS.get(int(model.geom_type[geom]))
            if kind is None or int(model.geom_group[geom]) == _FEELERS:
                continue
            a, b, c = model.geom_size[geom].tolist()
            half = (a, b, c) if kind == "box" else (a, a, a if kind == "sphere" else b)
            place, turn, rgba = (
                tuple(table[geom].tolist()) for table in (model.geom_pos, model.geom_quat, model.geom_rgba)
            )
            corners = _corners(model, geom) if kind == "mesh" else ()
            shape = Shape(kind, half, place, turn, rgba, corners)
            self.bodies[self._names[int(model.geom_bodyid[geom])]].append(shape)

    def at(self, moment: Moment) -> tuple[dict[str, Pose], tuple[Row, Row] | None, Row]:
        """The frames in the base; the force as an arrow; and the tip in the task frame, mm."""
        cell = self._cell
        cell.pose(moment)
        positions, turns = cell.data.xpos.tolist(), cell.data.xquat.tolist()
        frames = {
            name: Pose(tuple(positions[body]), tuple(turns[body])) for body, name in enumerate(self._names) if body
        }
        tip, force = cell.tip_m, cell.force_in_base(moment)
        arrow = None
        if force is not None:
            # It ends where it acts: from there on it would run within the peg.
            vector = force * _M_PER_N
            arrow = tuple((tip - vector).tolist()), tuple(vector.tolist())
        return frames, arrow, tuple((self._task_in_base.act(tip) * 1e3).tolist())


def _corners(model: mujoco.MjModel, geom: int) -> tuple[Row, ...]:
    """Corners of the only mesh's triangles, in the frame of the body that it belongs to."""
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    corners = model.geom_pos[geom] + model.mesh_vert[model.mesh_face.ravel()] @ turn.reshape(3, 3).T
    return tuple(tuple(corner) for corner in corners.tolist())


POSE_TICKS: Final = 5
"""A picture every so many ticks: 28 a second."""
_MEAN_TICKS: Final = 5
"""The arrow of the force is a mean over so many ticks; the noise of single samples would make it flicker."""
_NO_ZERO: Final = Tare((0.0,) * 6, "nothing")
_NO_WRENCH: Final = (float("nan"),) * 6
_SUPERVISED: Final = {"clamp": "has clamped", "doubt": "doubts", "trip": "draws the tool back"}
"""What the supervisor does from such an event on."""


class TrialStream:
    """Trial after trial, message by message; numbers wait for :meth:`flush`."""

    def __init__(self, display: Display) -> None:
        self._display, self.curve = display, LearningSoFar()
        self._log: TrialLog | None = None
        self._cell: CellFrames | None = None
        self._values: dict[str, dict[str, float]] = {}
        self._zero = _NO_ZERO
        self._wrenches: deque[Row] = deque(maxlen=_MEAN_TICKS)
        self._layout: Any = None
        self._rows: dict[str, tuple[list[int], list[Row]]] = {topic: ([], []) for topic in SERIES}

    def take(self, message: RawMessage) -> None:
        """Show a message of a trial, or keep its numbers."""
        try:
            if message.channel == START.id:
                self._begin(message)
            elif self._log is None:
                raise ValueError("no trial has begun")
            elif message.channel == TICK.id:
                self._tick(self._log, message.payload)
            else:
                file_in(self._log, message)
                self._sparse(self._log, message)
        except Exception as error:
            # Whatever protobuf or JSON may raise for bytes that are none of ours.
            raise LogError("live view", f"channel {message.channel}", f"cannot be shown ({error})", "") from error

    def flush(self) -> None:
        """Show the numbers that wait."""
        for topic, (times_ns, rows) in self._rows.items():
            if rows:
                self._display.series(topic, times_ns, rows)
                self._rows[topic] = [], []

    def _begin(self, message: RawMessage) -> None:
        start = decode_record("Start", StartRecord, message.payload)
        self._log, self._layout = TrialLog("live view", 0, start), None
        self._zero, self._values = _NO_ZERO, values_of(start)
        self._wrenches.clear()
        display, time_ns = self._display, message.time_ns
        display.event(time_ns, f"trial {start.number} begins: {start.command}, {start.policy or start.arm}")
        display.supervisor(time_ns, "passes the command", "")
        try:
            self._cell = CellFrames(self._log)
        except LogError as error:
            self._cell = None
            display.event(time_ns, f"{error}", serious=True)
        else:
            display.scene(time_ns, self._cell.bodies)

    def _tick(self, log: TrialLog, payload: bytes) -> None:
        record = decode_tick(payload, self._layout)
        self._layout = layout_of(record) or self._layout
        time_ns = record.deadline_ns if record.time_ns is None else record.time_ns
        if time_ns is None:
            return
        wrench = self._zero.taken_from(record.wrench)
        if wrench is None:
            self._wrenches.clear()
        else:
            self._wrenches.append(wrench)
            self._add("wrench", time_ns, wrench)
        if record.time_ns is not None and record.deadline_ns is not None and record.wrench is not None:
            late, age = record.time_ns - record.deadline_ns, record.time_ns - record.wrench.receive_time_ns
            self._add("timing", time_ns, (late * 1e-6, age * 1e-6))
        if record.asked_rad is not None and record.applied is not None:
            told = zip(record.asked_rad, record.applied.position_rad, strict=True)
            self._add("command", time_ns, (max(abs(a - b) for a, b in told) * 1e3,))
        joints = record.joints
        if joints is not None and joints.validity is not Validity.INVALID and not record.tick % POSE_TICKS:
            self._pose(log, record.tick, time_ns, joints.position_rad)

    def _pose(self, log: TrialLog, tick: int, time_ns: int, joints_rad: JointVector) -> None:
        if self._cell is None:
            return
        fx, fy, fz, tx, ty, tz = np.mean(self._wrenches, axis=0).tolist() if self._wrenches else _NO_WRENCH
        # Before the zero is known the arrow would show the tool's weight.
        known = bool(self._wrenches) and any(self._zero.bias)
        force, torque = ((fx, fy, fz), (tx, ty, tz)) if known else (None, None)
        decision = log.decisions[-1] if log.decisions else None
        frames, arrow, tip_mm = self._cell.at(Moment(tick, 0.0, joints_rad, force, torque, "", decision))
        self._display.pose(time_ns, frames, arrow)
        self._add("tip", time_ns, tip_mm)

    def _sparse(self, log: TrialLog, message: RawMessage) -> None:
        display, time_ns = self._display, message.time_ns
        if message.channel == DECISION.id:
            entry = log.decisions[-1]
            display.decision(time_ns, entry, self._values.get(entry.state, {}))
        elif message.channel == EVENT.id:
            event = log.events[-1]
            if event.name == "tare":
                self._zero = tare_of(log, [])
            state = _SUPERVISED.get(event.name)
            if state is not None:
                display.supervisor(time_ns, state, event.detail)
            display.event(time_ns, f"{event.name}: {event.detail}".rstrip(": "), serious=state is not None)
        elif message.channel == RECORDER.id:
            display.event(time_ns, f"recorder: {log.losses[-1].text}", serious=True)
        elif message.channel == END.id and log.end is not None:
            self._end(time_ns, log.start, log.end)

    def _end(self, time_ns: int, start: StartRecord, end: EndRecord) -> None:
        if end.outcome == Outcome.TRIPPED.value:
            what = "the next trial starts fresh" if start.world == SIMULATOR else "until a person acknowledges the trip"
            self._display.supervisor(time_ns, "latched", what)
        failed = end.error or end.stopped_by
        self._display.event(time_ns, f"trial {start.number} is over: {failed or end.outcome}", serious=bool(failed))
        if failed or end.outcome in ("", Outcome.INTERRUPTED.value):
            return
        success = end.outcome == Outcome.INSERTED.value if end.success is None else end.success
        self.curve.add(start.number, end.exploration_time_s, success, end.peak_force_N)
        self._display.learned(time_ns, self.curve)

    def _add(self, topic: str, time_ns: int, row: Row) -> None:
        times_ns, rows = self._rows[topic]
        times_ns.append(time_ns)
        rows.append(row)


def values_of(start: StartRecord) -> dict[str, dict[str, float]]:
    """What each action was worth in each state as a trial began; empty for a policy without such a table."""
    policy: dict[str, Any] = json.loads(start.policy_json or "{}")
    learner: dict[str, Any] = json.loads(start.learner_json or "{}")
    actions = [action["name"] for action in policy.get("actions", ())]
    state = learner or (policy.get("learner") or {}).get("state", {})
    rows = dict(zip(policy.get("states", ()), state.get("q", ()), strict=False))
    return {
        state: dict(zip(actions, map(float, row), strict=True))
        for state, row in rows.items()
        if len(row) == len(actions)
    }
