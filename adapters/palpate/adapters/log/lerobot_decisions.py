"""Decisions as columns of a LeRobot dataset, and examples back from them.

A frame has the newest decision at its tick: its number, and the state and the action of the example that it is, as
indices of names in ``info.json``. What is no example, such as a step that no action set has, is -1 there.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from palpate.adapters.log.lerobot_files import Feature, Table, require_pyarrow
from palpate.adapters.log.reader import TrialLog
from palpate.adapters.log.records import DecisionEntry
from palpate.core.errors import LogError

PERSON: Final = "person"
"""Source of a decision that a person made, in a lesson; the last of its grounds is the state of the example."""
COLUMNS: Final = ("decision.number", "decision.state", "decision.action")
FEATURES: Final = {name: Feature("int64") for name in COLUMNS}


class Names:
    """Names of states and actions, numbered as they come."""

    def __init__(self) -> None:
        self.states: dict[str, int] = {}
        self.actions: dict[str, int] = {}

    def columns(self, log: TrialLog, tick: npt.NDArray[np.int64]) -> Table:
        """The three columns of a trial's frames, which show these ticks."""
        rows = [(entry.number, *self._example(log, entry)) for entry in log.decisions]
        newest = np.searchsorted([entry.tick for entry in log.decisions], tick, side="right")
        shown = np.array([(-1, -1, -1), *rows], dtype=np.int64)[newest]
        return {name: shown[:, place] for place, name in enumerate(COLUMNS)}

    def to_json(self) -> dict[str, list[str]]:
        """As ``info.json`` has them."""
        return {"states": list(self.states), "actions": list(self.actions)}

    def _example(self, log: TrialLog, entry: DecisionEntry) -> tuple[int, int]:
        if entry.index is None:
            return -1, -1
        state = entry.state
        if entry.source == PERSON and entry.grounds:
            if entry.grounds[-1] < 0:
                return -1, -1
            state = _states(log)[int(entry.grounds[-1])]
        action = self.actions.setdefault(entry.action, len(self.actions))
        return self.states.setdefault(state, len(self.states)), action


def _states(log: TrialLog) -> tuple[str, ...]:
    from palpate.core.perception import perception_from_dict

    return perception_from_dict(json.loads(log.start.perception_json)).states


def import_examples(folder: Path) -> list[tuple[int, int, str, str]]:
    """The examples in a dataset that palpate exported, of the episodes that came to success.

    Args:
        folder: The dataset; LeRobot may have taken out episodes and columns that are not needed here.

    Returns:
        Of each the episode, the number of the decision, the state and the action.

    Raises:
        ConfigurationError: What reads Parquet files is not installed.
        LogError: It holds no decisions, or too few frames a second to hold all of them.
    """
    require_pyarrow()
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        info = json.loads((folder / "meta/info.json").read_text(encoding="utf-8"))
        names = info["palpate"]["states"], info["palpate"]["actions"]
        wanted = ["episode_index", "frame_index", *COLUMNS, "next.success"]
        parts = [pq.read_table(path, columns=wanted) for path in sorted((folder / "data").rglob("*.parquet"))]
        table: dict[str, Any] = {name: pa.concat_tables(parts)[name].to_numpy() for name in wanted}
    except (OSError, KeyError, ValueError, TypeError, pa.ArrowException) as error:
        problem = f"is no LeRobot dataset with decisions ({' '.join(str(error).split())[:120]})"
        raise LogError(str(folder), "", problem, "export it anew: palpate log export --to lerobot") from error
    return [row for episode in np.unique(table["episode_index"]) for row in _of_episode(folder, table, episode, names)]


def _of_episode(
    folder: Path, table: dict[str, Any], episode: int, names: tuple[list[str], list[str]]
) -> Iterator[tuple[int, int, str, str]]:
    rows = np.flatnonzero(table["episode_index"] == episode)
    rows = rows[np.argsort(table["frame_index"][rows])]
    number, state, action = (table[name][rows] for name in COLUMNS)
    if not table["next.success"][rows].any():
        return
    first = np.flatnonzero(np.diff(number, prepend=-1))
    if (np.diff(number[first], prepend=-1) != 1).any():
        problem = f"episode {episode} lacks decisions: its frames are fewer than they"
        raise LogError(str(folder), "", problem, "export it with more frames a second")
    for row in first:
        if state[row] >= 0:
            yield int(episode), int(number[row]), names[0][state[row]], names[1][action[row]]
