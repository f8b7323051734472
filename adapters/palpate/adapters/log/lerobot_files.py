"""The files of a LeRobotDataset v3.0. Pyarrow, which writes them, is imported only here and when it is needed."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from palpate.core.errors import ConfigurationError

Table: TypeAlias = dict[str, npt.NDArray[Any]]
"""Columns by name; one row a frame."""

_VERSION: Final = "v3.0"
_FILE: Final = "chunk-{chunk_index:03d}/file-{file_index:03d}"
_FIRST_FILE: Final = "chunk-000/file-000.parquet"
_QUANTILES: Final = (0.01, 0.10, 0.50, 0.90, 0.99)


@dataclass(frozen=True)
class Feature:
    """One column of the dataset.

    Attributes:
        dtype: ``float32``, ``int64``, ``bool`` or ``string``.
        size: Numbers in it.
        names: Their names; none for a single number.
    """

    dtype: str
    size: int = 1
    names: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """As ``info.json`` describes it."""
        return {"dtype": self.dtype, "shape": [self.size], "names": list(self.names) or None}


@dataclass(frozen=True)
class Episode:
    """One episode.

    Attributes:
        columns: Its frames.
        task: The task in words.
    """

    columns: Table
    task: str

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))


_ALWAYS: Final = {
    "timestamp": Feature("float32"),
    "frame_index": Feature("int64"),
    "episode_index": Feature("int64"),
    "index": Feature("int64"),
    "task_index": Feature("int64"),
}
"""Columns that every dataset has."""


def require_pyarrow() -> None:
    """Make sure that Parquet files can be written."""
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError as error:
        accepted = "csv, unless pyarrow is installed: pip install 'palpate[lerobot]'"
        raise ConfigurationError("to", "lerobot", accepted) from error


def write_dataset(
    folder: Path,
    episodes: Sequence[Episode],
    features: Mapping[str, Feature],
    fps: int,
    robot: str,
    more: Mapping[str, Any],
) -> None:
    """Write a dataset into an empty folder; each episode has the columns that ``features`` describes.

    Args:
        more: Further entries of ``info.json``.
    """
    tasks = sorted({episode.task for episode in episodes})
    every = {**features, **_ALWAYS}
    whole, start = [], 0
    for number, episode in enumerate(episodes):
        whole.append(_completed(episode, number, start, tasks.index(episode.task), fps, every))
        start += len(episode)
    _write_frames(folder / "data" / _FIRST_FILE, whole, every)
    _write_episodes(folder / "meta/episodes" / _FIRST_FILE, whole, [episode.task for episode in episodes])
    _write_tasks(folder / "meta/tasks.parquet", tasks)
    together = {
        name: np.concatenate([columns[name] for columns in whole]) for name in every if every[name].dtype != "string"
    }
    _write_json(folder / "meta/stats.json", {name: _statistics(values) for name, values in together.items()})
    _write_json(
        folder / "meta/info.json",
        {
            "codebase_version": _VERSION,
            "robot_type": robot,
            "total_episodes": len(episodes),
            "total_frames": start,
            "total_tasks": len(tasks),
            "chunks_size": 1000,
            "data_files_size_in_mb": 100,
            "video_files_size_in_mb": 200,
            "fps": fps,
            "splits": {"train": f"0:{len(episodes)}"},
            "data_path": f"data/{_FILE}.parquet",
            "video_path": None,
            "features": {name: feature.to_json() for name, feature in every.items()},
            **more,
        },
    )


def _completed(
    episode: Episode, number: int, start: int, task: int, fps: int, features: Mapping[str, Feature]
) -> Table:
    """The episode's columns as they are stored, with those that every dataset has."""
    frame = np.arange(len(episode))
    columns = {
        **episode.columns,
        "timestamp": frame / fps,
        "frame_index": frame,
        "episode_index": np.full(len(episode), number),
        "index": frame + start,
        "task_index": np.full(len(episode), task),
    }
    return {
        name: columns[name].astype(str if feature.dtype == "string" else feature.dtype)
        for name, feature in features.items()
    }


def _write_frames(path: Path, episodes: Sequence[Table], features: Mapping[str, Feature]) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    kinds: Any = {"float32": pa.float32(), "int64": pa.int64(), "bool": pa.bool_(), "string": pa.string()}
    fields = {
        name: kinds[feature.dtype] if feature.size == 1 else pa.list_(kinds[feature.dtype], feature.size)
        for name, feature in features.items()
    }
    path.parent.mkdir(parents=True)
    # A group of rows for each episode: whoever wants one reads one.
    with pq.ParquetWriter(path, pa.schema(list(fields.items())), compression="snappy") as writer:
        for columns in episodes:
            arrays = [
                pa.array(columns[name], kind)
                if features[name].size == 1
                else pa.FixedSizeListArray.from_arrays(pa.array(columns[name].ravel()), features[name].size)
                for name, kind in fields.items()
            ]
            writer.write_table(pa.Table.from_arrays(arrays, schema=writer.schema))


def _write_episodes(path: Path, episodes: Sequence[Table], tasks: Sequence[str]) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows = []
    for number, (columns, task) in enumerate(zip(episodes, tasks, strict=True)):
        index = columns["index"]
        row: dict[str, Any] = {
            "episode_index": number,
            "tasks": [task],
            "length": len(index),
            "data/chunk_index": 0,
            "data/file_index": 0,
            "dataset_from_index": int(index[0]),
            "dataset_to_index": int(index[-1]) + 1,
            "meta/episodes/chunk_index": 0,
            "meta/episodes/file_index": 0,
        }
        for name, values in columns.items():
            if values.dtype.kind == "U":
                continue
            row |= {f"stats/{name}/{key}": value for key, value in _statistics(values).items()}
        rows.append(row)
    path.parent.mkdir(parents=True)
    pq.write_table(pa.Table.from_pylist(rows), path, compression="snappy")


def _write_tasks(path: Path, tasks: Sequence[str]) -> None:
    """The tasks as a table that pandas reads with the task itself as index, as the format requires."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    index = "__index_level_0__"
    described = {
        "index_columns": [index],
        "column_indexes": [],
        "columns": [
            {"name": "task_index", "field_name": "task_index", "pandas_type": "int64", "numpy_type": "int64",
             "metadata": None},
            {"name": None, "field_name": index, "pandas_type": "unicode", "numpy_type": "object", "metadata": None},
        ],
        "pandas_version": "2.0.0",
    }  # fmt: skip
    table = pa.table({"task_index": pa.array(range(len(tasks)), pa.int64()), index: pa.array(tasks, pa.string())})
    pq.write_table(table.replace_schema_metadata({"pandas": json.dumps(described)}), path)


def _statistics(values: npt.NDArray[Any]) -> dict[str, list[Any]]:
    """Over the frames, number by number."""
    rows = values.reshape(len(values), -1).astype(np.float64)
    found = {
        "min": rows.min(axis=0),
        "max": rows.max(axis=0),
        "mean": rows.mean(axis=0),
        "std": rows.std(axis=0),
        **{f"q{round(q * 100):02d}": np.quantile(rows, q, axis=0) for q in _QUANTILES},
    }
    return {**{name: value.tolist() for name, value in found.items()}, "count": [len(rows)]}


def _write_json(path: Path, value: Mapping[str, Any]) -> None:
    path.write_text(json.dumps(value, indent=4, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")
