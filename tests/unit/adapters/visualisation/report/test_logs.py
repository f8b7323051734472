"""The logs of a folder, and how regular their control cycle was."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from palpate.adapters.log.reader import read_log
from palpate.adapters.visualisation.report.logs import Timing, logs_in, spread_over, timing_section
from palpate.core.errors import LogError
from tests.support.log_surgery import indices, messages_of, write_log
from tests.unit.adapters.visualisation.report.sample_folders import in_real_time

GOLDEN = Path(__file__).parents[4] / "golden"
LOG = GOLDEN / "train-paper.mcap"


@pytest.fixture
def run(tmp_path: Path) -> Path:
    for place in ("logs/trial-00001.mcap", "logs/torque/trial-00000.mcap", "logs/trial-00000.mcap"):
        (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(GOLDEN / "train-paper.mcap", tmp_path / place)
    return tmp_path


@pytest.mark.parametrize("size", [0, 5, 16, 5000, -1])
def test_a_torn_log_is_found_without_reading_it(run: Path, size: int) -> None:
    path = run / "logs" / "trial-00001.mcap"
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(LogError, match=r"trial-00001\.mcap: ends in the middle.*--no-logs"):
        logs_in(run)


@pytest.mark.parametrize(
    ("count", "most", "chosen"), [(0, 8, []), (3, 8, [0, 1, 2]), (9, 3, [0, 4, 8]), (350, 8, [0, 349])]
)
def test_spread(count: int, most: int, chosen: list[int]) -> None:
    paths = [Path(str(n)) for n in range(count)]
    found = [int(path.name) for path in spread_over(paths, most)]
    assert len(found) == min(count, most)
    assert set(chosen) <= set(found)
    assert found == sorted(set(found))


PERIOD_MS = 1e3 / 140


def test_in_the_simulator_time_waits() -> None:
    log = read_log(LOG)
    timing = Timing.of([log, log])
    assert timing.exact
    assert len(timing.interval_ms) == 2 * (len(log.ticks) - 1)
    section = timing_section([log], "1 log")
    assert section is not None
    assert section.pictures == ()
    assert "every interval is 7.1429 ms" in section.text[0]
    assert section.tables[0].rows[0][1:] == ("7.1429",) * 4


def test_on_a_real_clock_there_is_a_spread(tmp_path: Path) -> None:
    path = Path(shutil.copy(LOG, tmp_path / "log.mcap"))
    in_real_time(path)
    log = read_log(path)
    timing = Timing.of([log])
    assert not timing.exact
    late = [(r.time_ns - r.deadline_ns) * 1e-6 for r in log.records() if r.time_ns and r.deadline_ns is not None]
    assert timing.late_ms == pytest.approx(late)
    assert timing.interval_ms.mean() == pytest.approx(PERIOD_MS, rel=1e-3)
    section = timing_section([log], "1 log")
    assert section is not None
    (picture,) = section.pictures
    assert f"the longest {timing.interval_ms.max():.3f} ms" in picture.alt
    (beat,) = section.tables
    assert beat.caption.startswith(f"{int(np.sum(np.array(late) > 1.0))} tick")


def test_ticks_that_the_log_lacks_are_counted(tmp_path: Path) -> None:
    messages = messages_of(LOG)
    ticks = indices(messages, "/tick")
    gone = set(ticks[50:53])
    path = write_log(tmp_path / "log.mcap", [m for n, m in enumerate(messages) if n not in gone])
    timing = Timing.of([read_log(path)])
    assert timing.missing == 3
    # The interval over the gap is none between successive ticks.
    assert timing.exact
