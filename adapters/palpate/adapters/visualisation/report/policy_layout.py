"""Where the states of a policy belong in a picture: in regions of position and torque, or simply in rows."""

from dataclasses import dataclass
from typing import Final

from palpate.core.policy import LEARNED, PolicyDocument, TableRow

_SIGNS: Final = {"-": -1, "0": 0, "+": 1}
_ROW: Final = 6


@dataclass(frozen=True)
class Block:
    """A grid of states.

    Attributes:
        places: State to (column, row), from the left and from the top.
        columns: Names of the columns; empty without.
        rows: Names of the rows; empty without.
        axes: Names of the two axes; empty without.
        caption: What must be known to read it; empty without.
        gap: (column, row) and words for a place that another block covers; None without.
    """

    title: str
    places: dict[str, tuple[int, int]]
    columns: tuple[str, ...] = ()
    rows: tuple[str, ...] = ()
    axes: tuple[str, str] = ("", "")
    caption: str = ""
    gap: tuple[int, int, str] | None = None


def blocks_of(document: PolicyDocument, most: int) -> tuple[Block, ...]:
    """The blocks of a policy.

    The paper's 8 position and 9 torque regions become two maps in which every state lies on the side of the hole on
    which it is measured, so that in a good policy all arrows point to the middle: the hole lies at heading (-ty, tx),
    and hence a torque region at (ty, -tx) of it.

    Args:
        most: States at most, where they have no place on a map; see :func:`informative`.
    """
    position = {state: place for state in document.states if (place := _place(state, "x", "y")) is not None}
    torque = {state: place for state in document.states if (place := _place(state, "tx", "ty")) is not None}
    if len(position) + len(torque) == len(document.states) and position and torque:
        return _position(position, torque), _torque(torque)
    chosen = {row.state for row in informative(document, most)}
    states = [state for state in document.states if state in chosen]
    return (Block("", {state: (n % _ROW, n // _ROW) for n, state in enumerate(states)}),)


def informative(document: PolicyDocument, most: int) -> list[TableRow]:
    """The rows that matter: learned from, or not learned at all; of too many, the most visited ones.

    All of them where none does.
    """
    rows = [row for row in document.table if row.visits or row.source != LEARNED] or list(document.table)
    chosen = {row.state for row in sorted(rows, key=lambda row: -row.visits)[:most]}
    return [row for row in document.table if row.state in chosen]


def _position(position: dict[str, tuple[int, int]], torque: dict[str, tuple[int, int]]) -> Block:
    # As seen from above, along z into the hole: x to the right, y downwards.
    return Block(
        "Position regions",
        {state: (x + 1, y + 1) for state, (x, y) in position.items()},
        ("x -", "x 0", "x +"),
        ("y -", "y 0", "y +"),
        ("position along x", "position along y"),
        "Seen from above: x to the right, y down. Arrows that point to the middle point to the hole.",
        None if (0, 0) in position.values() or not torque else (1, 1, "torque\ndecides"),
    )


def _torque(torque: dict[str, tuple[int, int]]) -> Block:
    return Block(
        "Torque regions",
        {state: (ty + 1, 1 - tx) for state, (tx, ty) in torque.items()},
        ("ty -", "ty 0", "ty +"),
        ("tx +", "tx 0", "tx -"),
        ("torque about y", "torque about x"),
        "Each region lies on the side of the hole on which its torque is felt. Arrows that point to the middle point to"
        " the hole.",
    )


def _place(state: str, first: str, second: str) -> tuple[int, int] | None:
    """Signs of a state such as ``x- y0``; None of any other."""
    words = state.split(" ")
    if [word[:-1] for word in words] != [first, second] or any(word[-1] not in _SIGNS for word in words):
        return None
    return _SIGNS[words[0][-1]], _SIGNS[words[1][-1]]
