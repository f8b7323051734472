"""Trials in Foxglove: over a WebSocket while they run, or in an MCAP file of Foxglove's own messages."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, Self

import foxglove
from foxglove import channels, messages
from typing_extensions import override

from palpate.adapters.log import DecisionEntry
from palpate.adapters.visualisation.live.display import (
    BASE,
    MOST_TRIALS,
    SERIES,
    Display,
    LearningSoFar,
    Pose,
    Row,
    Shape,
)

_ARROW_COLOUR: Final = messages.Color(r=0.85, g=0.1, b=0.1, a=1.0)


class FoxgloveDisplay(Display):
    """Foxglove's messages on channels of their own.

    What is newest on each channel is kept, and sent again when somebody subscribes: Foxglove keeps nothing of a live
    connection that it lost.

    Args:
        context: Foxglove's; whoever opened it has given it a server, or a file.
        now: Tells the run's time, ns, to those who watch.
    """

    def __init__(
        self, context: foxglove.Context, end: Callable[[], object], now: Callable[[int], object] = lambda _: None
    ) -> None:
        # Channels of a context that nobody holds are closed.
        self._context = context
        self._end, self._now, self._newest = end, now, dict[str, tuple[Any, Any, int]]()
        self._asked = threading.Event()
        self._frames = channels.FrameTransformsChannel("/tf", context=context)
        self._scene = channels.SceneUpdateChannel("/scene", context=context)
        # Apart from the scene, or whoever comes anew would get the newest arrow for it.
        self._arrow = channels.SceneUpdateChannel("/force", context=context)
        self._log = channels.LogChannel("/log", context=context)
        self._plain = {
            topic: foxglove.Channel(f"/{topic}", schema=_schema(topic, names), context=context)
            for topic, names in (*SERIES.items(), *_RECORDS.items())
        }

    @classmethod
    def served(cls, port: int) -> Self:
        """On a WebSocket of this computer."""
        # What it has to say of clients that come and go would stand between the run's own lines.
        foxglove.set_log_level("CRITICAL")
        context = foxglove.Context()
        made: list[FoxgloveDisplay] = []

        class Listener:
            """Only notes that somebody came: it is called in a thread of the server's."""

            def on_subscribe(self, client: Any, channel: Any) -> None:
                for display in made:
                    display.ask()

            def on_unsubscribe(self, client: Any, channel: Any) -> None:
                """Is no reason to do anything."""

        server = foxglove.start_server(
            name="palpate", host="127.0.0.1", port=port, context=context, server_listener=Listener(),
            capabilities=[foxglove.Capability.Time],
        )  # fmt: skip
        display = cls(context, server.stop, server.broadcast_time)
        made.append(display)
        return display

    @classmethod
    def file(cls, path: Path) -> Self:
        """Into a file that is not there yet."""
        context = foxglove.Context()
        return cls(context, foxglove.open_mcap(path, context=context).close)

    def ask(self) -> None:
        """Somebody has subscribed. May be called from any thread."""
        self._asked.set()

    @override
    def scene(self, time_ns: int, bodies: dict[str, list[Shape]]) -> None:
        # Named by their frames, they take the place of those of the trial before.
        entities = [_entity(frame, shapes) for frame, shapes in bodies.items() if shapes]
        self._send(self._scene, messages.SceneUpdate(entities=entities), time_ns)

    @override
    def pose(self, time_ns: int, frames: dict[str, Pose], force: tuple[Row, Row] | None) -> None:
        stamp = _stamp(time_ns)
        transforms = [
            messages.FrameTransform(
                timestamp=stamp, parent_frame_id=BASE, child_frame_id=name,
                translation=_vector(pose.position_m), rotation=_quaternion(pose.quaternion),
            )
            for name, pose in frames.items()
        ]  # fmt: skip
        self._now(time_ns)
        self._send(self._frames, messages.FrameTransforms(transforms=transforms), time_ns)
        arrows = [] if force is None else [_arrow(*force)]
        entity = messages.SceneEntity(timestamp=stamp, frame_id=BASE, id="force", arrows=arrows)
        self._send(self._arrow, messages.SceneUpdate(entities=[entity]), time_ns)

    @override
    def series(self, topic: str, times_ns: Sequence[int], rows: Sequence[Row]) -> None:
        # What nobody has subscribed to is kept for who comes, and not made into text.
        first = 0 if self._plain[topic].has_sinks() else len(rows) - 1
        for time_ns, row in zip(times_ns[first:], rows[first:], strict=True):
            self._tell(topic, time_ns, row)

    @override
    def decision(self, time_ns: int, entry: DecisionEntry, values: dict[str, float]) -> None:
        self._tell("decision", time_ns, (entry.number, entry.symbol, entry.state, entry.action, entry.source))
        worth = [{"action": action, "value": value} for action, value in values.items()]
        self._tell("action_values", time_ns, (entry.state, entry.action, worth))

    @override
    def supervisor(self, time_ns: int, state: str, detail: str) -> None:
        self._tell("supervisor", time_ns, (state, detail))

    @override
    def event(self, time_ns: int, text: str, *, serious: bool = False) -> None:
        level = messages.LogLevel.Warning if serious else messages.LogLevel.Info
        self._send(self._log, messages.Log(timestamp=_stamp(time_ns), level=level, message=text), time_ns)

    @override
    def learned(self, time_ns: int, curve: LearningSoFar) -> None:
        columns = (curve.trials, curve.times_s, curve.averages_s, curve.successes, curve.peaks_N)
        self._tell("learning_curve", time_ns, (curve.label, *(column[-MOST_TRIALS:] for column in columns)))

    @override
    def renew(self) -> None:
        if self._asked.is_set():
            self._asked.clear()
            for channel, message, time_ns in self._newest.values():
                channel.log(message, log_time=time_ns)

    @override
    def close(self) -> None:
        self._end()

    def _tell(self, topic: str, time_ns: int, values: Sequence[Any]) -> None:
        names = SERIES.get(topic) or tuple(_RECORDS[topic])
        message = json.dumps(dict(zip(names, values, strict=True)))
        self._send(self._plain[topic], message, time_ns)

    def _send(self, channel: Any, message: Any, time_ns: int) -> None:
        channel.log(message, log_time=time_ns)
        self._newest[channel.topic()] = channel, message, time_ns


_TEXT, _NUMBER = {"type": "string"}, {"type": "number"}
_NUMBERS = {"type": "array", "items": _NUMBER}
_WORTH = {"type": "object", "properties": {"action": _TEXT, "value": _NUMBER}}
_RECORDS: Final[dict[str, dict[str, Any]]] = {
    "decision": {"number": _NUMBER, "symbol": _TEXT, "state": _TEXT, "action": _TEXT, "source": _TEXT},
    "action_values": {"state": _TEXT, "chosen": _TEXT, "values": {"type": "array", "items": _WORTH}},
    "supervisor": {"state": _TEXT, "detail": _TEXT},
    "learning_curve": {
        "run": _TEXT, "trial": _NUMBERS, "time_s": _NUMBERS, "average_s": _NUMBERS, "success": _NUMBERS,
        "peak_force_N": _NUMBERS,
    },
}  # fmt: skip
"""Messages that come now and then, field by field as JSON schema has them."""


def _schema(topic: str, fields: Any) -> dict[str, Any]:
    properties = fields if isinstance(fields, dict) else dict.fromkeys(fields, _NUMBER)
    return {"type": "object", "title": f"palpate.{topic}", "properties": properties}


def _stamp(time_ns: int) -> messages.Timestamp:
    return messages.Timestamp(time_ns // 1_000_000_000, time_ns % 1_000_000_000)


def _vector(row: Row) -> messages.Vector3:
    return messages.Vector3(x=row[0], y=row[1], z=row[2])


def _quaternion(row: Row) -> messages.Quaternion:
    w, x, y, z = row
    return messages.Quaternion(w=w, x=x, y=y, z=z)


def _pose(position_m: Row, quaternion: Row) -> messages.Pose:
    return messages.Pose(position=_vector(position_m), orientation=_quaternion(quaternion))


def _entity(frame: str, shapes: Sequence[Shape]) -> messages.SceneEntity:
    cubes, cylinders, spheres, triangles = [], [], [], []
    for shape in shapes:
        pose, size = _pose(shape.position_m, shape.quaternion), _vector(tuple(2.0 * half for half in shape.half_m))
        r, g, b, a = shape.rgba
        color = messages.Color(r=r, g=g, b=b, a=a)
        if shape.kind == "box":
            cubes.append(messages.CubePrimitive(pose=pose, size=size, color=color))
        elif shape.kind == "sphere":
            spheres.append(messages.SpherePrimitive(pose=pose, size=size, color=color))
        elif shape.kind == "mesh":
            points = [messages.Point3(x=x, y=y, z=z) for x, y, z in shape.triangles_m]
            triangles.append(messages.TriangleListPrimitive(points=points, color=color))
        else:
            made = messages.CylinderPrimitive(pose=pose, size=size, bottom_scale=1.0, top_scale=1.0, color=color)
            cylinders.append(made)
    return messages.SceneEntity(
        frame_id=frame,
        id=frame,
        frame_locked=True,
        cubes=cubes,
        cylinders=cylinders,
        spheres=spheres,
        triangles=triangles,
    )


def _arrow(begin_m: Row, vector_m: Row) -> messages.ArrowPrimitive:
    """An arrow along x, turned into the vector."""
    x, y, z = vector_m
    length = (x * x + y * y + z * z) ** 0.5
    # The quaternion half-way between the x axis and the vector; about z where they are opposite.
    w, qy, qz = length + x, -z, y
    norm = (w * w + qy * qy + qz * qz) ** 0.5
    turn = (0.0, 0.0, 0.0, 1.0) if norm < 1e-12 else (w / norm, 0.0, qy / norm, qz / norm)
    return messages.ArrowPrimitive(
        pose=_pose(begin_m, turn), shaft_length=0.8 * length, head_length=0.2 * length,
        shaft_diameter=0.004, head_diameter=0.008, color=_ARROW_COLOUR,
    )  # fmt: skip
