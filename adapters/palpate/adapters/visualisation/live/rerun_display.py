"""Trials in Rerun: from a server to which its viewer connects while they run, or in a file of its own."""

import ctypes
import os
import signal
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
import rerun as rr
import rerun_cli
from rerun import blueprint
from typing_extensions import override

from palpate.adapters.config import RunConfig
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

_CLOCK: Final = "run clock"
"""The timeline: seconds of the run's clock."""
_MEMORY: Final = "512MB"
"""What the server keeps for those who come late; then the oldest goes."""
_ARROW_COLOUR: Final = (217, 26, 26)


def layout() -> blueprint.Blueprint:
    """What stands where in the viewer."""
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


def _end_with_parent() -> None:
    set_death_signal = 1
    ctypes.CDLL(None).prctl(set_death_signal, signal.SIGKILL)


class RerunDisplay(Display):
    """A recording of Rerun's, which its server keeps whole for whoever comes anew.

    Args:
        server: Ends with the display.
    """

    def __init__(self, recording: rr.RecordingStream, server: subprocess.Popen[bytes] | None = None) -> None:
        self._recording, self._server = recording, server
        # When something was shown says nothing about the run.
        recording.set_log_time_enabled(False)
        recording.set_log_tick_enabled(False)
        for topic, names in SERIES.items():
            recording.log(topic, rr.SeriesLines(names=list(names)), static=True)
        recording.log("cell", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)

    @classmethod
    def served(cls, port: int) -> Self:
        """For viewers of this computer that connect to this port.

        A recording that serves itself listens on every address; Rerun's program takes one.
        """
        program = next(iter(rerun_cli.__path__)) + "/rerun"
        words = ["--serve-grpc", "--bind", "127.0.0.1", "--port", str(port), "--server-memory-limit", _MEMORY]
        quiet = subprocess.DEVNULL
        server = subprocess.Popen(
            [program, *words], stdin=quiet, stdout=quiet, stderr=quiet, preexec_fn=_end_with_parent,
            # Its makers are told of its use, except by machines that test.
            env={**os.environ, "CI": "1"},
        )  # fmt: skip
        recording = rr.RecordingStream("palpate")
        recording.connect_grpc(f"rerun+http://127.0.0.1:{port}/proxy", default_blueprint=layout())
        return cls(recording, server)

    @classmethod
    def file(cls, path: Path, name: str) -> Self:
        """Into a file that is not there yet, as a recording of this name."""
        recording = rr.RecordingStream("palpate", recording_id=name, send_properties=False)
        recording.save(path, default_blueprint=layout())
        return cls(recording)

    @override
    def scene(self, time_ns: int, bodies: dict[str, list[Shape]]) -> None:
        self._at(time_ns)
        for frame, shapes in bodies.items():
            for kind, made in _of_kinds(shapes).items():
                self._recording.log(f"cell/{frame}/{kind}", made)

    @override
    def pose(self, time_ns: int, frames: dict[str, Pose], force: tuple[Row, Row] | None) -> None:
        self._at(time_ns)
        for name, pose in frames.items():
            w, x, y, z = pose.quaternion
            self._recording.log(f"cell/{name}", rr.Transform3D(translation=pose.position_m, quaternion=(x, y, z, w)))
        origins, vectors = ([], []) if force is None else ([force[0]], [force[1]])
        self._recording.log(
            f"cell/{BASE}/force", rr.Arrows3D(origins=origins, vectors=vectors, colors=_ARROW_COLOUR, radii=0.002)
        )

    @override
    def series(self, topic: str, times_ns: Sequence[int], rows: Sequence[Row]) -> None:
        columns = rr.Scalars.columns(scalars=np.array(rows).ravel()).partition([len(rows[0])] * len(rows))
        self._recording.send_columns(
            topic, [rr.TimeColumn(_CLOCK, duration=np.array(times_ns, "timedelta64[ns]"))], columns
        )

    @override
    def decision(self, time_ns: int, entry: DecisionEntry, values: dict[str, float]) -> None:
        self._at(time_ns)
        text = f"{entry.number}: **{entry.action}** in {entry.state}, felt {entry.symbol}, {entry.source}"
        if values:
            text += "\n\n" + ", ".join(f"{action} {value:.3f}" for action, value in values.items())
            worth = rr.BarChart(list(values.values()))
            self._recording.log("action_values", worth)
        self._recording.log("decision", rr.TextDocument(text, media_type="text/markdown"))

    @override
    def supervisor(self, time_ns: int, state: str, detail: str) -> None:
        self._at(time_ns)
        text = f"**{state}** {detail}".rstrip()
        self._recording.log("supervisor", rr.TextDocument(text, media_type="text/markdown"))

    @override
    def event(self, time_ns: int, text: str, *, serious: bool = False) -> None:
        self._at(time_ns)
        self._recording.log("log", rr.TextLog(text, level="WARN" if serious else "INFO"))

    @override
    def learned(self, time_ns: int, curve: LearningSoFar) -> None:
        self._at(time_ns)
        at = ["learning_curve", *([curve.label] if curve.label else [])]
        # Bars from the first trial that is shown on; Rerun draws no line over anything but time.
        self._recording.log(at, rr.BarChart(curve.times_s[-MOST_TRIALS:]))

    @override
    def renew(self) -> None:
        """Rerun's server does that."""

    @override
    def close(self) -> None:
        self._recording.flush()
        self._recording.disconnect()
        if self._server is not None:
            self._server.kill()
            self._server.wait()

    def _at(self, time_ns: int) -> None:
        self._recording.set_time(_CLOCK, duration=np.timedelta64(time_ns, "ns"))


def _of_kinds(shapes: Sequence[Shape]) -> dict[str, Any]:
    """The shapes as Rerun has them, those of a kind together."""
    made: dict[str, Any] = {}
    for kind in {shape.kind for shape in shapes}:
        some = [shape for shape in shapes if shape.kind == kind]
        turns = [(x, y, z, w) for w, x, y, z in (shape.quaternion for shape in some)]
        centres, halves = [shape.position_m for shape in some], [shape.half_m for shape in some]
        colours = [tuple(round(255 * part) for part in shape.rgba) for shape in some]
        solid: dict[str, Any] = {"colors": colours, "quaternions": turns, "fill_mode": "solid"}
        if kind == "box":
            made[kind] = rr.Boxes3D(half_sizes=halves, centers=centres, **solid)
        elif kind == "sphere":
            made[kind] = rr.Ellipsoids3D(half_sizes=halves, centers=centres, **solid)
        elif kind == "mesh":
            # One a frame: the peg.
            made[kind] = rr.Mesh3D(vertex_positions=some[0].triangles_m, albedo_factor=colours[0])
        else:
            lengths, radii = [2 * half[2] for half in halves], [half[0] for half in halves]
            made[kind] = rr.Cylinders3D(lengths=lengths, radii=radii, centers=centres, **solid)
    return made
