"""What a run's folder tells, finished or not."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from palpate.adapters.experiments.results import RunFolder
from palpate.adapters.visualisation.report.run_source import RunSource, curve_of
from palpate.core.errors import ConfigurationError, OutputError
from tests.unit.adapters.samples import scored_trial
from tests.unit.adapters.visualisation.report.samples import rows


def source(count: int, **changes: Any) -> RunSource:
    run = RunSource(Path(), tuple(rows(*map(float, range(count)))), {}, {"command": "train"}, {}, None)
    return replace(run, **changes)


@pytest.mark.parametrize(("trials", "late"), [(1, 1), (2, 1), (9, 4), (50, 25), (350, 25)])
def test_of_a_run_that_learns_the_end_counts(trials: int, late: int) -> None:
    run = source(trials)
    assert len(run.late) == late
    assert run.late[-1].trial == trials - 1


def test_where_nothing_says_so_a_falling_temperature_is_learning() -> None:
    run = source(3, facts={})
    assert not run.learns
    assert replace(run, rows=tuple(replace(r, temperature=5.0 - r.trial) for r in run.rows)).learns


def test_missing_trials() -> None:
    assert source(3, facts={"trials": 5}).missing == 2
    assert source(3, facts={"trials": 3}).missing == 0
    assert source(3).missing == 0


def test_a_folder_of_an_unfinished_run(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="no finished trial"):
        RunSource.read(tmp_path)
    RunFolder(tmp_path).append_trial(scored_trial(0))
    run = RunSource.read(tmp_path)
    assert len(run.rows) == 1
    assert run.document is None
    assert run.policy == "unknown"
    (tmp_path / "policy.json").write_text("{}")
    with pytest.raises(ConfigurationError, match=r"policy\.json"):
        RunSource.read(tmp_path)


def test_curves() -> None:
    curve = curve_of("a", [tuple(rows(1.0, 2.0, wins=[True, False])), tuple(rows(3.0, 4.0, 5.0))])
    assert curve.costs == ((1.0, 2.0), (3.0, 4.0, 5.0))
    assert curve.successes == ((True, False), (True, True, True))
    assert curve.trials == 2
