"""``palpate faults``, with a small share of the campaign."""

from __future__ import annotations

import csv
from pathlib import Path

from tests.command_line import CommandLine


def test_a_share_of_the_campaign_ends_in_stops_and_readable_logs(palpate: CommandLine, tmp_path: Path) -> None:
    out = tmp_path / "runs.csv"
    printed = palpate.succeed("faults", "--most", 24, "--jobs", 1, "--out", out)
    assert "24 runs, the fault struck in 24" in printed
    assert "failed: 0" in printed
    assert "unreadable logs, or logs that do not tell of their fault: 0" in printed
    with out.open() as stream:
        runs = list(csv.DictReader(stream))
    assert len(runs) == 24
    assert len({run["variant"] for run in runs}) > 10
    assert {run["verdict"] for run in runs} <= {"tolerable", "detected", "unobservable"}
    assert any(run["verdict"] == "detected" for run in runs)
    assert {run["safe_stop"] for run in runs} == {"True"}
    assert all(run["cause"] for run in runs if run["verdict"] == "detected")
    assert "runs in which the arm was told to stop at the end: 24" in printed
    assert "is there already" in palpate.refusal("faults", "--out", out)


def test_the_campaign_fails_without_a_supervisor(palpate: CommandLine) -> None:
    done = palpate("faults", "--most", 12, "--jobs", 1, "--no-supervisor")
    assert done.code == 1
    assert "failed: 0" not in done.stdout
