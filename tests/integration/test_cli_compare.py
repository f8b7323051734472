"""``palpate compare``: one table of all strategies on the same trials."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

from tests.integration.command_line import succeed

COMPARATORS = ["omniscient", "torque", "spiral-10", "spiral-5", "random"]
NUMBERS = (
    "success", "success_low", "success_high", "median_s", "median_s_low", "median_s_high", "p95_s", "p95_s_low",
    "p95_s_high",
)  # fmt: skip


def test_all_strategies_stand_in_one_table(trained: Path, tmp_path: Path) -> None:
    # Two runs in folders of one name: neither may take the other's place in the table.
    policies = []
    for place in ("a", "b"):
        folder = tmp_path / place / "run"
        folder.mkdir(parents=True)
        policies.append(str(shutil.copy(trained / "policy.json", folder)))
    out = tmp_path / "out"
    words = ("--task.time-limit-s", "1", "--trials", 2, "--out", out)
    printed = succeed("compare", *words, "--policy", *policies)

    with (out / "compare.csv").open(newline="") as stream:
        rows = {row["policy"]: row for row in csv.DictReader(stream)}
    assert list(rows) == ["run", policies[1], *COMPARATORS]
    for row in rows.values():
        assert int(row["trials"]) == 2
        for low, middle, high in ((f"{c}_low", c, f"{c}_high") for c in ("success", "median_s", "p95_s")):
            assert 0.0 <= float(row[low]) <= float(row[middle]) <= float(row[high]) <= 1.0
        assert 4.0 < float(row["peak_force_N"]) < 30.0
        assert 0.05 < float(row["capture_half_width_mm"]) < 0.5
    assert float(rows["omniscient"]["success"]) == 1.0
    # Equal policies on equal trials.
    assert {k: v for k, v in rows["run"].items() if k != "policy"} == {
        k: v for k, v in rows[policies[1]].items() if k != "policy"
    }

    text = (out / "compare.txt").read_text()
    assert text in printed
    width = rows["random"]["capture_half_width_mm"]
    assert f"capture half-width {float(width):.3f} mm" in text
    lines = text.splitlines()
    assert [line.split()[0] for line in lines[1:8]] == list(rows)
    summary = json.loads((out / "summary.json").read_text())
    assert summary["finished"] is True
    assert summary["capture_half_width_mm"] == float(width)
    assert (out / "run.toml").is_file()
