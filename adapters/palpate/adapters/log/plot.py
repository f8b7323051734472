"""Plot of one trial over time."""

from collections.abc import Iterable, Sequence
from itertools import product
from typing import Any, Final

import numpy as np

from palpate.adapters.log.figure import drawing
from palpate.adapters.log.reader import RETRACTION, TrialLog
from palpate.adapters.log.series import Series, series_of
from palpate.adapters.log.tables import counted

# Colours that are distinguishable with any colour vision (Okabe and Ito).
_XYZ: Final = ("#0072b2", "#d55e00", "#009e73")
_JOINTS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
_PHASES: Final = {
    "lift": "#e8e8e8", "transfer": "#cfe2f3", "settle": "#d9ead3", "approach": "#fff2cc",
    "explore": "#f9cb9c", "insert": "#b4d8c8", RETRACTION: "#f4b6b6",
}  # fmt: skip
_EVENTS: Final = {
    "tare": "tare", "contact": "contact", "contact lost": "contact lost", "sunk below the surface": "in the hole",
    "false drop": "false drop", "hole": "at depth", "trip": "trip", "interrupt": "interrupt", "end": "end",
}  # fmt: skip
"""Events to draw, with their labels."""
_WIDTH_IN: Final = 13.0
_LABEL_SHARE: Final = 0.015
"""Width of a slanted label as a fraction of the time axis."""


def timeline(log: TrialLog, kind: str = "png") -> bytes:
    """Plot forces, torques, tip position, states, actions, phases and events on a shared time axis.

    Raises:
        LogError: The log has nothing to plot, or its configuration is invalid.
    """
    series = series_of(log)
    altered = bool(np.any(np.nan_to_num(series.altered_mrad) != 0.0))
    states, actions = _distinct(d.state for d in log.decisions), _distinct(d.action for d in log.decisions)
    symbols = _distinct(d.symbol for d in log.decisions)
    # Without a memory of states, symbol and state are equal, and one strip shows both.
    apart = any(d.symbol != d.state for d in log.decisions)
    heights = [2.0, 2.0, 2.2]
    heights += [1.2] * altered
    strips = [("state" if apart else "symbol\n= state", states, "state")] if states else []
    strips = ([("symbol", symbols, "symbol")] if apart else []) + strips
    strips += [("action", actions, "action")] if actions else []
    heights += [max(0.35 + 0.17 * len(names), 0.75) for _, names, _ in strips] + [0.4]

    with drawing(_WIDTH_IN, sum(heights) + 1.6, 110, kind) as canvas:
        figure = canvas.figure
        panels: Any = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights, squeeze=False)[:, 0]
        rest = list(panels)
        axes = rest.pop(0)
        force_panel(axes, series)
        _dress(axes, "force [N]\nsensor frame")
        axes = rest.pop(0)
        for i, name in enumerate(("Tx", "Ty", "Tz")):
            axes.plot(series.time_s, series.wrench[:, 3 + i], color=_XYZ[i], linewidth=0.9, label=name)
        _dress(axes, "torque [N m]\nsensor frame")
        _position(rest.pop(0), series, log)
        if altered:
            _altered(rest.pop(0), series)
        for title, names, attribute in strips:
            _strip(rest.pop(0), log, series, title, names, attribute)
        _phases(rest.pop(0), log, series)
        _events(panels, log, series)
        for gap, axes in product(np.flatnonzero(series.ticks < 0), panels):
            axes.axvspan(series.time_s[gap - 1], series.time_s[gap + 1], color="#bbbbbb", alpha=0.5)
        figure.align_ylabels(panels)
        panels[-1].set_xlabel("time since the first tick [s]")
        panels[0].set_xlim(0.0, max(float(series.time_s[-1]), 1e-3) * 1.005)
        figure.suptitle(_title(log, series, altered), fontsize=10)
    return canvas.content


def force_panel(axes: Any, series: Series) -> None:
    """Plot the force, its norm, and the job's force limit."""
    force_N = series.wrench[:, :3]
    for i, name in enumerate(("Fx", "Fy", "Fz")):
        axes.plot(series.time_s, force_N[:, i], color=_XYZ[i], linewidth=0.9, label=name)
    axes.plot(series.time_s, np.sqrt(np.sum(force_N * force_N, axis=1)), color="black", linewidth=0.9, label="norm")
    limit_N = series.config.task.max_force_N
    axes.axhline(limit_N, color="#a3232b", linewidth=1.0, linestyle="--", label=f"limit {limit_N:g} N")


def _position(axes: Any, series: Series, log: TrialLog) -> None:
    for i, name in enumerate("xyz"):
        axes.plot(series.time_s, series.tip_mm[:, i], color=_XYZ[i], linewidth=1.3, label=name)
    flat = series.config.cell.contour.shape == "none"
    hole = log.end.true_hole_in_task_m[:2] if flat and log.end is not None else ()
    for i, value in enumerate(hole):
        label = "true hole, x and y" if i == 0 else None
        axes.axhline(value * 1e3, color=_XYZ[i], linewidth=0.8, linestyle=(i, (2, 2)), alpha=0.7, label=label)
    _dress(axes, "tip [mm]\ntask frame, z into the part")


def _altered(axes: Any, series: Series) -> None:
    for joint, values in enumerate(series.altered_mrad.T):
        if np.any(np.nan_to_num(values) != 0.0):
            colour = _JOINTS[joint % len(_JOINTS)]
            axes.plot(series.time_s, values, color=colour, linewidth=1.0, label=f"joint {joint + 1}")
    _dress(axes, "applied minus\nrequested [mrad]")


def _dress(axes: Any, label: str) -> None:
    axes.set_ylabel(label, fontsize=9)
    axes.grid(alpha=0.25)
    axes.margins(y=0.08)
    axes.tick_params(labelsize=8)
    # Next to the panel, because inside it would hide lines.
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False)


def _strip(axes: Any, log: TrialLog, series: Series, title: str, names: Sequence[str], attribute: str) -> None:
    """Draw a row for each name, with a bar from each decision to the next."""
    changes = [d.tick for d in log.decisions]
    # The last action ended with the phase or with the log.
    later = [event.tick for event in log.events if event.tick > changes[-1] and event.name in ("phase", "end")]
    ends = [*changes[1:], min(later, default=changes[-1] + series.config.task.ticks_per_action)]
    for row, name in enumerate(names):
        bars = [
            (series.time_of(a), series.time_of(b) - series.time_of(a))
            for d, a, b in zip(log.decisions, changes, ends, strict=True)
            if getattr(d, attribute) == name
        ]
        colour = _JOINTS[0] if attribute == "action" else _JOINTS[3]
        axes.broken_barh(bars, (row - 0.4, 0.8), facecolor=colour, edgecolor="white", linewidth=0.5, alpha=0.8)
    axes.set_yticks(range(len(names)), names, fontsize=7)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_ylabel(title, fontsize=9)
    axes.grid(alpha=0.25)


def _phases(axes: Any, log: TrialLog, series: Series) -> None:
    """Draw the phases as coloured bands. Names that do not fit are next to the panel."""
    phases = log.phases
    if not phases or phases[0][0] > 0:
        phases.insert(0, (0, "lift"))
    narrow: dict[str, Any] = {}
    ends = [series.time_of(tick) for tick, _ in phases[1:]] + [float(series.time_s[-1])]
    for (tick, name), end_s in zip(phases, ends, strict=True):
        start_s = series.time_of(tick)
        band = axes.axvspan(start_s, end_s, color=_PHASES.get(name, "#dddddd"))
        # Approximate fit: a letter of this size is a thirteenth of an inch wide.
        if (end_s - start_s) / max(float(series.time_s[-1]), 1e-9) * 0.8 * _WIDTH_IN > len(name) / 13 + 0.05:
            axes.text((start_s + end_s) / 2, 0.5, name, ha="center", va="center", fontsize=8)
        else:
            narrow[name] = band
    axes.legend(narrow.values(), narrow, loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False)
    axes.set_yticks([])
    axes.set_ylim(0.0, 1.0)
    axes.set_ylabel("phase", fontsize=9)


def _events(panels: Any, log: TrialLog, series: Series) -> None:
    named: list[tuple[float, list[str]]] = []
    room_s = _LABEL_SHARE * float(series.time_s[-1])
    for event in log.events:
        if event.name not in _EVENTS:
            continue
        time_s = series.time_of(event.tick)
        for axes in panels:
            axes.axvline(time_s, color="#444444", linewidth=0.8, linestyle="--", alpha=0.7)
        # Overlapping labels would be unreadable.
        if named and time_s - named[-1][0] < room_s:
            named[-1][1].append(_EVENTS[event.name])
        else:
            named.append((time_s, [_EVENTS[event.name]]))
    top = panels[0]
    for time_s, names in named:
        top.annotate(
            ", ".join(names), (time_s, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 3),
            textcoords="offset points", rotation=40, ha="left", va="bottom", fontsize=8, color="#222222",
        )  # fmt: skip


def _title(log: TrialLog, series: Series, altered: bool) -> str:
    start, end, config = log.start, log.end, series.config
    first = f"{start.command}, {start.arm}, scenario {config.scenario}, seed {start.seed}, trial {start.number}"
    if end is None:
        came = "the log ends before the trial did"
    elif end.error:
        came = f"ended by {end.error}"
    else:
        actions = f", {counted(end.actions, 'action')}" if end.actions else ""
        came = f"{log.outcome}, {end.exploration_time_s:.2f} s of exploration{actions}"
        came += {True: ", success", False: ", no success", None: ""}[end.success]
    missing = int(np.sum(series.ticks < 0))
    notes = [f"tared by {series.tare.origin}"]
    notes.append("commands not always applied as requested" if altered else "all commands applied as requested")
    notes += [log.trip.detail] if log.trip is not None else []
    notes += [f"{counted(missing, 'gap')} with missing ticks, in grey"] * (missing > 0)
    return f"{first}: {came}\n{'; '.join(notes)}"


def _distinct(names: Iterable[str]) -> list[str]:
    return sorted(set(names))
