"""Compare baselines and trained policies on the same trials, in one table."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from typing import Any

from palpate.adapters.experiments.policies import BASELINES, baselines_of
from palpate.adapters.experiments.results import RunFolder
from palpate.adapters.experiments.run import Run
from palpate.adapters.experiments.statistics import shown_interval, summary_of
from palpate.adapters.log import aligned, csv_text


@dataclass(frozen=True)
class Comparison:
    """Results for policies on the same trials: summaries by name, whether all trials ran, and recording failures."""

    summaries: Mapping[str, Mapping[str, Any]]
    finished: bool
    losses: Sequence[str]

    def table(self) -> str:
        """Return success, times and forces, one policy per line, with 95 % intervals in brackets where possible."""
        lines = [("policy", "success", "median s", "95th percentile s", "peak N", "trips")]
        for name, s in self.summaries.items():
            lines.append(
                (
                    name,
                    f"{s['success']:.0%} [{s['success_95'][0]:.0%}, {s['success_95'][1]:.0%}]",
                    shown_interval(s["median_s"], *s["median_95_s"]),
                    shown_interval(s["p95_s"], *s["p95_95_s"]),
                    f"{s['peak_force_N']:.1f}",
                    str(sum(s["trips"].values())),
                )
            )
        return aligned(lines)

    def csv(self) -> str:
        """Return the table as CSV."""
        columns = ("success", "median_s", "p95_s")
        header = ["policy", "trials", *(f"{c}{end}" for c in columns for end in ("", "_low", "_high"))]
        rows: list[list[Any]] = [[*header, "peak_force_N", "trips"]]
        for name, s in self.summaries.items():
            intervals = (s["success_95"], s["median_95_s"], s["p95_95_s"])
            values = [v for c, (low, high) in zip(columns, intervals, strict=True) for v in (s[c], low, high)]
            rows.append([name, s["trials"], *values, s["peak_force_N"], sum(s["trips"].values())])
        return csv_text(rows)


Shown = Callable[[str], AbstractContextManager[Any]]
"""Function that shows the progress of the named policy and returns an object with ``update(trials)``."""


def compare(run: Run, policies: Sequence[str], trials: int, folder: RunFolder, shown: Shown) -> Comparison:
    """Run policies and the task's baselines on the same trials, and record them; Ctrl-C ends the comparison early.

    Raises:
        ConfigurationError: A setting or a policy is rejected.
        OutputError: The folder already holds a run.
    """
    folder.require_free()
    chosen = [run.chosen(name) for name in (*policies, *baselines_of(run.config))]
    summaries: dict[str, dict[str, Any]] = {}
    finished = True
    with ExitStack() as kept, ExitStack() as opened:
        run.begin(kept, folder, "compare", trials=trials, policy=list(policies))
        recording = run.record(kept, opened, folder)
        for number, policy in enumerate(chosen):
            # Two runs may have folders with the same name, or with the name of a baseline.
            taken = policy.label in summaries or (policy.label in BASELINES and policy.name not in BASELINES)
            logs = f"{policy.label}-{number}" if taken else policy.label
            # Each policy has its own rig, so that all of them start at the same clock time.
            with run, shown(policy.label) as bar:
                rows = run.rows(policy, trials, recording, command="compare", subfolder=logs, on_trial=bar.update)
            finished = len(rows) == trials
            if rows:
                summaries[policy.name if taken else policy.label] = summary_of(rows)
            if not finished:
                break
    return Comparison(summaries, finished, recording.losses)
