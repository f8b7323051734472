"""Which logs a report reads, and that torn ones are found at once."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from palpate.adapters.visualisation.report.logs import LogShelf, logs_in, spread_over
from palpate.core.errors import LogError

GOLDEN = Path(__file__).parents[4] / "golden"


@pytest.fixture
def run(tmp_path: Path) -> Path:
    for place in ("logs/trial-00001.mcap", "logs/torque/trial-00000.mcap", "logs/trial-00000.mcap"):
        (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(GOLDEN / "train-paper.mcap", tmp_path / place)
    return tmp_path


def test_all_logs_in_order(run: Path) -> None:
    (run / "logs" / "trial-00007.mcap.cut-short-1").write_bytes(b"set aside")
    found = [path.relative_to(run).as_posix() for path in logs_in(run)]
    assert found == ["logs/torque/trial-00000.mcap", "logs/trial-00000.mcap", "logs/trial-00001.mcap"]


def test_no_logs(tmp_path: Path) -> None:
    assert logs_in(tmp_path) == ()


@pytest.mark.parametrize("size", [0, 5, 16, 5000, -1])
def test_a_torn_log_is_found_without_reading_it(run: Path, size: int) -> None:
    path = run / "logs" / "trial-00001.mcap"
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(LogError, match=r"trial-00001\.mcap: ends in the middle.*--no-logs"):
        logs_in(run)


def test_logs_are_read_once(run: Path) -> None:
    shelf = LogShelf()
    path = run / "logs" / "trial-00000.mcap"
    assert shelf.log(path) is shelf.log(path)


@pytest.mark.parametrize(
    ("count", "most", "chosen"), [(0, 8, []), (3, 8, [0, 1, 2]), (9, 3, [0, 4, 8]), (350, 8, [0, 349])]
)
def test_spread(count: int, most: int, chosen: list[int]) -> None:
    paths = [Path(str(n)) for n in range(count)]
    found = [int(path.name) for path in spread_over(paths, most)]
    assert len(found) == min(count, most)
    assert set(chosen) <= set(found)
    assert found == sorted(set(found))
