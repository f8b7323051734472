"""``palpate compare``: one table of all strategies on the same trials."""

import csv
import json
from pathlib import Path

STRATEGIES = ["oracle", "torque", "spiral-10", "spiral-5", "random"]


def test_all_strategies_stand_in_one_table(compared):
    with (compared / "compare.csv").open(newline="") as stream:
        rows = {row["policy"]: row for row in csv.DictReader(stream)}
    # Two runs in folders of one name: neither may take the other's place in the table.
    one, two, *others = rows
    assert (one, Path(two).parts[-2:], others) == ("run", ("run", "policy.json"), STRATEGIES)
    for row in rows.values():
        assert int(row["trials"]) == 2
        assert 0.0 <= float(row["success_low"]) <= float(row["success"]) <= float(row["success_high"]) <= 1.0
        for quantile in ("median_s", "p95_s"):
            # Of two trials no interval can be stated.
            assert (row[f"{quantile}_low"], row[f"{quantile}_high"]) == ("", "")
            assert 0.0 <= float(row[quantile]) <= 0.6
        assert 4.0 < float(row["peak_force_N"]) < 30.0
    assert float(rows["oracle"]["success"]) == 1.0
    # Equal policies on equal trials.
    assert rows[one] | {"policy": ""} == rows[two] | {"policy": ""}

    text = (compared / "compare.txt").read_text()
    assert text in compared.with_name(f"{compared.name}.txt").read_text()
    assert [line.split()[0] for line in text.splitlines()[1:8]] == list(rows)
    summary = json.loads((compared / "summary.json").read_text())
    assert summary["finished"] is True
    assert (compared / "run.toml").is_file()
