"""Decisions as columns of a LeRobot dataset, and examples back from them.

A frame has the newest decision at its tick: its number, and the names of state and action of the example that it is,
which are empty for what is no example, such as a step that no action set has.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from palpate.adapters.log.lerobot_files import Table, require_pyarrow
from palpate.adapters.log.reader import TrialLog
from palpate.adapters.log.records import DecisionEntry
from palpate.core.errors import LogError, one_line
from palpate.core.policy import PERSON

_NUMBER, _STATE, _ACTION = "decision.number", "decision.state", "decision.action"
_COLUMNS: Final = (_NUMBER, _STATE, _ACTION)


def decision_columns(log: TrialLog, tick: npt.NDArray[np.int64]) -> Table:
    """The columns of a trial's frames, which show these ticks."""
    newest = np.searchsorted([entry.tick for entry in log.decisions], tick, side="right")
    numbers = np.array([-1, *(entry.number for entry in log.decisions)])
    examples = np.array([("", ""), *(_example(log, entry) for entry in log.decisions)])
    return {_NUMBER: numbers[newest], _STATE: examples[newest, 0], _ACTION: examples[newest, 1]}


def _example(log: TrialLog, entry: DecisionEntry) -> tuple[str, str]:
    if entry.index is None:
        return "", ""
    if entry.source != PERSON or not entry.grounds:
        return entry.state, entry.action
    state = int(entry.grounds[-1])
    return ("", "") if state < 0 else (_states(log)[state], entry.action)


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
        wanted = ["episode_index", "frame_index", *_COLUMNS, "next.success"]
        parts = [pq.read_table(path, columns=wanted) for path in sorted((folder / "data").rglob("*.parquet"))]
        table: dict[str, Any] = {name: pa.concat_tables(parts)[name].to_numpy() for name in wanted}
    except (OSError, KeyError, ValueError, TypeError, pa.ArrowException) as error:
        problem = f"is no LeRobot dataset with decisions ({one_line(error)[:120]})"
        raise LogError(str(folder), "", problem, "export it anew: palpate log export --to lerobot") from error
    return [row for episode in np.unique(table["episode_index"]) for row in _of_episode(folder, table, episode)]


def _of_episode(folder: Path, table: dict[str, Any], episode: int) -> Iterator[tuple[int, int, str, str]]:
    rows = np.flatnonzero(table["episode_index"] == episode)
    rows = rows[np.argsort(table["frame_index"][rows])]
    number, state, action = (table[name][rows] for name in _COLUMNS)
    if not table["next.success"][rows].any():
        return
    first = np.flatnonzero(np.diff(number, prepend=-1))
    if (np.diff(number[first], prepend=-1) != 1).any():
        problem = f"episode {episode} lacks decisions: its frames are fewer than they"
        raise LogError(str(folder), "", problem, "export it with more frames a second")
    for row in first:
        if state[row]:
            yield int(episode), int(number[row]), state[row], action[row]
