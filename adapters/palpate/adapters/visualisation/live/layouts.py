"""Ready layouts: what stands where in a viewer."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from palpate.adapters.config import RunConfig
from palpate.adapters.visualisation.live.display import BASE
from palpate.adapters.visualisation.live.live_view import require_viewer


def write_layout(viewer: str, path: Path) -> None:
    """Write the layout for a viewer: JSON for Foxglove, a blueprint for Rerun, which ``--live rerun`` brings along.

    Raises:
        UsageError: It is Rerun's, whose package is not installed.
    """
    if viewer == "foxglove":
        path.write_text(json.dumps(foxglove_layout(), indent=1) + "\n", encoding="utf-8")
        return
    require_viewer(viewer)
    from palpate.adapters.visualisation.live.rerun_display import layout

    layout().save("palpate", path)


def foxglove_layout() -> dict[str, Any]:
    """The layout for Foxglove."""
    goal = RunConfig().task.goal
    cell = {
        "followTf": BASE,
        "followMode": "follow-none",
        "cameraState": {
            "perspective": True, "distance": 0.75, "phi": 68.0, "thetaOffset": 125.0, "fovy": 45, "near": 0.01,
            "far": 100, "target": [0, 0, 0], "targetOrientation": [0, 0, 0, 1],
            "targetOffset": [goal.x_mm * 1e-3, goal.y_mm * 1e-3, goal.z_mm * 1e-3 + 0.1],
        },
        # Neither axes nor lines to the base: the bodies themselves are to be seen.
        "scene": {"transforms": {"showLabel": False, "axisScale": 0, "lineWidth": 0}},
        "topics": {"/scene": {"visible": True}, "/force": {"visible": True}},
        "layers": {"grid": {"layerId": "foxglove.Grid", "visible": True, "frameId": BASE, "size": 2, "divisions": 20}},
    }  # fmt: skip
    panels: dict[str, Any] = {
        "3D!cell": cell,
        "Plot!force": _plot("Force, N", "/wrench", ("fx_N", "fy_N", "fz_N")),
        "Plot!torque": _plot("Torque, N m", "/wrench", ("tx_Nm", "ty_Nm", "tz_Nm")),
        "Plot!tip": _plot("Tip in the task frame, mm", "/tip", ("x_mm", "y_mm", "z_mm")),
        "Plot!late": _plot("Lateness, ms", "/timing", ("late_ms", "wrench_age_ms")),
        "Plot!learning": _plot("Learning curve, s", "/learning_curve", ("time_s[:]", "average_s[:]"))
        | {"xAxisVal": "currentCustom", "xAxisPath": _path("/learning_curve", "trial[:]")},
        "StateTransitions!decision": {
            "paths": [
                _path("/decision", "symbol"), _path("/decision", "state"), _path("/decision", "action"),
                _path("/supervisor", "state") | {"label": "supervisor"},
            ],
            "isSynced": True,
        },
        "RawMessages!values": {"topicPath": "/action_values", "expansion": "all"},
        "RosOut!log": {"topicToRender": "/log", "minLogLevel": 1},
    }  # fmt: skip
    plots = _stack("column", ["Plot!force", "Plot!torque", "Plot!tip", "Plot!late"])
    left = _split("column", _split("row", "3D!cell", "RawMessages!values", 70), "StateTransitions!decision", 70)
    right = _split("column", plots, _split("row", "Plot!learning", "RosOut!log", 50), 72)
    return {
        "configById": panels, "globalVariables": {}, "userNodes": {}, "playbackConfig": {"speed": 1},
        "layout": _split("row", left, right, 55),
    }  # fmt: skip


def _path(topic: str, field: str) -> dict[str, Any]:
    label = field.removesuffix("[:]")
    return {"value": f"{topic}.{field}", "enabled": True, "timestampMethod": "receiveTime", "label": label}


def _plot(title: str, topic: str, fields: Sequence[str]) -> dict[str, Any]:
    return {
        "title": title, "paths": [_path(topic, field) for field in fields], "showXAxisLabels": True,
        "showYAxisLabels": True, "showLegend": True, "legendDisplay": "floating", "isSynced": True,
        "xAxisVal": "timestamp", "showPlotValuesInLegend": False, "sidebarDimension": 240,
    }  # fmt: skip


def _split(direction: str, first: Any, second: Any, percentage: float) -> dict[str, Any]:
    return {"direction": direction, "first": first, "second": second, "splitPercentage": percentage}


def _stack(direction: str, panels: list[str]) -> Any:
    if len(panels) == 1:
        return panels[0]
    return _split(direction, panels[0], _stack(direction, panels[1:]), 100 / len(panels))
