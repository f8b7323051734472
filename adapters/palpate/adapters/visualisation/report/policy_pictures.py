"""A policy as arrows over its states, and its Q values."""

from math import hypot
from textwrap import wrap
from typing import Any, Final

import numpy as np

from palpate.adapters.visualisation.report.canvas import WIDTH_IN, drawn, file_name
from palpate.adapters.visualisation.report.page import Picture, counted
from palpate.adapters.visualisation.report.policy_layout import Block, blocks_of, informative
from palpate.core.policy import LEARNED, PolicyDocument, TableRow

MOST_STATES: Final = 48
"""States that are drawn; of more, those that were learned from most often."""
_WIDTH_IN: Final = 4.6
_COLOUR_MAP: Final = "viridis"
_NOT_LEARNED: Final = {"programmed": "#fbe3c0", "examples": "#e3d9f2"}
_NEVER: Final = "#ececec"
_ONE_LINE: Final = 12
"""Longer names of states are broken."""
_UPRIGHT: Final = 6
"""Longer names of actions are turned, or they lie upon each other."""


def arrows_pictures(name: str, document: PolicyDocument, title: str) -> tuple[Picture, ...]:
    """The best action of each state as an arrow, on the colour of its value; y points down, as seen from above.

    Returns:
        A picture for each map of states; one for states that have no place on a map. None of a learner by a model.
    """
    if document.learner is not None and document.learner.kind in ("belief", "hmm"):
        return ()
    from matplotlib.ticker import MaxNLocator

    blocks = blocks_of(document, MOST_STATES)
    rows = {row.state: row for row in document.table}
    steps = {a.name: a.displacement_mm[:2] for a in document.actions}
    longest = max((hypot(*step) for step in steps.values()), default=1.0) or 1.0
    # One for all blocks: colours mean the same in each.
    shades = _Shades(document)
    pictures = []
    for block in blocks:
        height = _WIDTH_IN + 0.5 if block.rows else 0.9 + 0.85 * (1 + max(row for _, row in block.places.values()))
        with drawn(height, _WIDTH_IN if block.rows else WIDTH_IN) as canvas:
            axes = canvas.figure.add_subplot()
            _frame(axes, block)
            for state, (column, row) in block.places.items():
                _tile(axes, column, row, rows[state], shades)
                _action(axes, column, row, rows[state], steps, longest, shades.of(rows[state])[1])
            if shades.map is not None:
                bar = canvas.figure.colorbar(
                    shades.map, ax=axes, orientation="horizontal", shrink=0.7, aspect=40, ticks=MaxNLocator(5)
                )
                bar.set_label("Q of the best action: higher is better")
                bar.outline.set_visible(False)
        shown = [rows[state] for state in block.places]
        pictures.append(
            Picture(
                f"{name}-{file_name(block.title)}" if block.title else name,
                _alt(shown, f"{title}, {block.title.lower()}" if block.title else title),
                _caption(document, block, shown, title),
                canvas.content,
                wide=not block.rows,
            )
        )
    return tuple(pictures)


def q_picture(name: str, document: PolicyDocument, title: str) -> Picture | None:
    """Q of every state and action as numbers on colours; None where nothing was learned."""
    rows = [row for row in informative(document, MOST_STATES) if row.q is not None]
    if not any(row.visits for row in rows):
        return None
    q = np.array([row.q for row in rows], dtype=float)
    visits = np.array([row.visits_per_action for row in rows])
    q[visits == 0] = np.nan
    actions = [action.name for action in document.actions]
    with drawn(1.2 + 0.31 * len(rows), max(WIDTH_IN, 1.8 + 0.55 * len(actions))) as canvas:
        axes = canvas.figure.add_subplot()
        axes.grid(visible=False)
        axes.set_facecolor(_NEVER)
        image = axes.imshow(q, cmap=_COLOUR_MAP, aspect="auto")
        low, high = np.nanmin(q), np.nanmax(q)
        for (line, column), value in np.ndenumerate(q):
            if np.isnan(value):
                axes.text(column, line, "-", ha="center", va="center", fontsize=9, color="#555555")
                continue
            best = value == np.nanmax(q[line])
            axes.text(
                column, line, f"{value:.1f}", ha="center", va="center", fontsize=9, color=_ink(value, low, high),
                fontweight="bold" if best else "normal",
            )  # fmt: skip
        turned = {"rotation": 30, "ha": "right", "rotation_mode": "anchor"} if max(map(len, actions)) > _UPRIGHT else {}
        axes.set_xticks(range(len(actions)), actions, **turned)
        axes.set_yticks(range(len(rows)), [row.state for row in rows])
        axes.tick_params(length=0.0)
        axes.set(xlabel="action", ylabel="state")
        for spine in axes.spines.values():
            spine.set_visible(False)
        canvas.figure.colorbar(image, ax=axes, label="Q", fraction=0.04, pad=0.02).outline.set_visible(False)
    line, column = np.unravel_index(np.nanargmin(q), q.shape)
    untried = counted(int(np.isnan(q).sum()), "pair")
    alt = (
        f"Q values of {title}: {counted(len(rows), 'state')} by {len(actions)} actions, from {low:.2f} (state"
        f" {rows[line].state}, action {actions[column]}) to {high:.2f}. {untried} never tried."
    )
    caption = f"{title}. Bold: the best action of the state. Grey: never tried."
    if len(document.states) > len(rows):
        caption += f" {_some(len(rows), len(document.states))}"
    return Picture(name, alt, caption, canvas.content, wide=True)


class _Shades:
    """Colours by value, over the states that were learned from."""

    def __init__(self, document: PolicyDocument) -> None:
        values = [row.value for row in document.table if _is_known(row) and row.value is not None]
        self.map: Any = None
        if len(set(values)) > 1:
            from matplotlib.cm import ScalarMappable
            from matplotlib.colors import Normalize

            self.low, self.high = min(values), max(values)
            self.map = ScalarMappable(Normalize(self.low, self.high), _COLOUR_MAP)

    def of(self, row: TableRow) -> tuple[Any, str]:
        """Colour of a tile, and of what is written on it."""
        if _is_known(row) and row.value is not None and self.map is not None:
            return self.map.to_rgba(row.value), _ink(row.value, self.low, self.high)
        return _NOT_LEARNED.get(row.source, _NEVER), "black"


def _ink(value: float, low: float, high: float) -> str:
    """Black on the light half of the colours, white on the dark one."""
    return "black" if high <= low or (value - low) / (high - low) > 0.55 else "white"


def _frame(axes: Any, block: Block) -> None:
    columns = 1 + max(column for column, _ in block.places.values())
    rows = 1 + max(row for _, row in block.places.values())
    axes.set(xlim=(-0.5, columns - 0.5), ylim=(rows - 0.5, -0.5), aspect="equal")
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.tick_params(length=0.0)
    axes.set_xticks(range(len(block.columns)), block.columns)
    axes.set_yticks(range(len(block.rows)), block.rows)
    axes.set_title(block.title)
    axes.set(xlabel=block.axes[0], ylabel=block.axes[1])
    if block.gap is not None:
        column, row, words = block.gap
        axes.text(column, row, words, ha="center", va="center", fontsize=9, color="#444444")


def _tile(axes: Any, column: int, row: int, entry: TableRow, shades: _Shades) -> None:
    from matplotlib.patches import Rectangle

    colour, ink = shades.of(entry)
    axes.add_patch(Rectangle((column - 0.48, row - 0.48), 0.96, 0.96, facecolor=colour, linewidth=0.0))
    # A state with a memory has a line for each of its symbols.
    lines = [line for part in entry.state.replace(" > ", "\n> ").split("\n") for line in wrap(part, _ONE_LINE)]
    size = 9 if len(lines) == 1 and len(lines[0]) <= 9 else 7
    axes.text(column, row - 0.45, "\n".join(lines[:3]), ha="center", va="top", fontsize=size, color=ink)
    words = f"{entry.value:.1f}" if entry.visits and entry.value is not None else ""
    if entry.source != LEARNED:
        words = entry.source
    elif not entry.visits:
        words = "never visited"
    elif _untried(entry):
        words = "untried"
    axes.text(column, row + 0.37, words, ha="center", va="center", fontsize=9, color=ink)


def _is_known(entry: TableRow) -> bool:
    """Whether its value comes from experience."""
    return entry.visits > 0 and not _untried(entry)


def _untried(entry: TableRow) -> bool:
    """Whether what looks best was never done: its value is then the initial one."""
    return entry.visits_per_action is not None and not entry.visits_per_action[entry.best]


def _action(
    axes: Any,
    column: int,
    row: int,
    entry: TableRow,
    steps: dict[str, tuple[float, float]],
    longest: float,
    ink: str,
) -> None:
    """An arrow; the name of an action that leads nowhere, such as a skill."""
    if entry.source == LEARNED and not entry.visits:
        # All actions are equal there: an arrow would show what was never learned.
        return
    # Below a name of several lines there is less room.
    reach, below = (0.24, 0.0) if len(entry.state) <= _ONE_LINE else (0.17, 0.12)
    x, y = (reach * value / longest for value in steps[entry.action])
    if hypot(x, y) == 0.0:
        words = "\n".join(wrap(entry.action, 12))
        axes.text(column, row + 0.1, words, ha="center", va="center", fontsize=9, fontweight="bold", color=ink)
        return
    from matplotlib.patheffects import withStroke

    # Paler where nothing was learned of it.
    colour = "#767676" if entry.source == LEARNED and _untried(entry) else "black"

    axes.annotate(
        "", (column + x, row + below + y), (column - x, row + below - y),
        arrowprops={
            "arrowstyle": "-|>,head_length=0.5,head_width=0.28", "color": colour, "linewidth": 2.4,
            "shrinkA": 0, "shrinkB": 0, "mutation_scale": 11,
            # Stands out from dark and from light colours.
            "path_effects": [withStroke(linewidth=5.0, foreground="white")],
        },
    )  # fmt: skip


def _some(shown: int, states: int) -> str:
    return f"Of {states} states {shown} are shown, those that were learned from most often."


def _alt(rows: list[TableRow], title: str) -> str:
    known = [row for row in rows if row.visits or row.source != LEARNED]
    best = "; ".join(f"{row.state}: {row.action}" for row in known[:20])
    more = f"; and {len(known) - 20} more states" if len(known) > 20 else ""
    return f"Best action of each state, {title}. {best or 'Nothing was learned'}{more}."


def _caption(document: PolicyDocument, block: Block, rows: list[TableRow], title: str) -> str:
    text = f"{title}. {block.title + '. ' if block.title else ''}{block.caption}"
    if not block.rows:
        directed = any(any(action.displacement_mm[:2]) for action in document.actions)
        text += "Arrows: x to the right, y down." if directed else "Bold: the best action."
        if len(rows) < len(document.states):
            text += f" {_some(len(rows), len(document.states))}"
    if any(row.source == LEARNED and row.visits and _untried(row) for row in rows):
        text += " Untried: that action was never taken there, and only its initial value makes it the best."
    sources = {row.source for row in rows} - {LEARNED}
    if sources:
        text += f" Not learned: {' and '.join(sorted(sources))}."
    return text
