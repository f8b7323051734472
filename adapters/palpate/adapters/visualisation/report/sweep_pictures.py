"""Success and time against a swept setting."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from palpate.adapters.experiments import exact_interval, mean_with_interval
from palpate.adapters.visualisation.report.canvas import COLOURS, LINES, drawn, file_name, legend_above
from palpate.adapters.visualisation.report.page import Picture, share
from palpate.adapters.visualisation.report.study_source import is_number, shown_value

_MARKS = "osD^vP*X"


@dataclass(frozen=True)
class Point:
    """What came of one value of the setting.

    Attributes:
        times_s: Mean time of each seed, at least one.
    """

    value: Any
    times_s: tuple[float, ...]
    wins: int
    trials: int

    @property
    def success(self) -> tuple[float, float, float]:
        """Share of successes, and the exact interval of it."""
        return (self.wins / self.trials, *exact_interval(self.wins, self.trials))


@dataclass(frozen=True)
class SweepSeries:
    """One line of the picture: a policy, and what else is held."""

    label: str
    points: tuple[Point, ...]


def sweep_picture(field: str, values: Sequence[Any], series: Sequence[SweepSeries]) -> Picture:
    """Time above and success below, against the values of a setting."""
    numeric = all(map(is_number, values))
    with drawn(5.0 + 0.1 * len(series)) as canvas:
        upper, lower = canvas.figure.subplots(2, 1, sharex=True, height_ratios=(1.5, 1.0))
        for number, line in enumerate(series):
            _draw(upper, lower, line, number, len(series), values, numeric)
        upper.set(ylabel="mean time [s]")
        upper.set_ylim(bottom=0.0)
        lower.set(xlabel=field, ylabel="success", ylim=(-0.04, 1.04))
        lower.yaxis.set_major_formatter(lambda value, _: f"{value:.0%}")
        if not numeric or len(values) <= 8:
            places = values if numeric else range(len(values))
            lower.set_xticks(places, [shown_value(value) for value in values])
        legend_above(canvas.figure, upper)
    caption = (
        "Time: every seed a circle, their mean a filled mark, bars the 95 % interval of that mean (Student's t over"
        " seeds; none for a single seed). Success: all seeds' trials, bars the exact 95 % interval. Of policies"
        " that learn, the last 25 trials count (half of them if fewer than 50). Policies lie beside each other."
    )
    return Picture(f"sweep-{file_name(field)}", _alt(field, series), caption, canvas.content)


def _draw(
    upper: Any, lower: Any, line: SweepSeries, number: int, of: int, values: Sequence[Any], numeric: bool
) -> None:
    colour, mark = COLOURS[number % len(COLOURS)], _MARKS[number % len(_MARKS)]
    places = [float(p.value) if numeric else float(_index(values, p.value)) for p in line.points]
    width = (max(map(float, values)) - min(map(float, values))) / (len(values) - 1) if numeric else 1.0
    # Beside each other, so that no bar hides another.
    spread = 0.07 if numeric else 0.4
    places = [place + spread * width * (number - (of - 1) / 2) / max(of - 1, 1) for place in places]
    style: dict[str, Any] = {
        # Nothing lies between two names, and a line would suggest that something does.
        "color": colour, "marker": mark, "linestyle": LINES[number % len(LINES)] if numeric else "none",
        "linewidth": 1.6, "markersize": 6,
    }  # fmt: skip
    means = [mean_with_interval(p.times_s) for p in line.points]
    upper.plot(places, [mean for mean, _, _ in means], label=line.label, **style)
    for place, point, (_, low, high) in zip(places, line.points, means, strict=True):
        upper.scatter(
            [place] * len(point.times_s), point.times_s, s=26, facecolors="none", edgecolors=colour, linewidths=1.0
        )
        if low is not None:
            upper.vlines(place, low, high, color=colour, linewidth=1.3)
        lower.vlines(place, *point.success[1:], color=colour, linewidth=1.3)
    lower.plot(places, [point.success[0] for point in line.points], **style)


def _index(values: Sequence[Any], value: Any) -> int:
    return [shown_value(v) for v in values].index(shown_value(value))


def _alt(field: str, series: Sequence[SweepSeries]) -> str:
    lines = []
    for line in series:
        described = [
            f"{shown_value(p.value)}: {mean_with_interval(p.times_s)[0]:.2f} s, {share(p.success[0])} success"
            for p in line.points
        ]
        lines.append(f"{line.label}: {'; '.join(described)}")
    return f"Mean time and success against {field}. {'. '.join(lines)}."
