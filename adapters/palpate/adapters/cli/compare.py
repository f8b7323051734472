"""``palpate compare``."""

import sys
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from palpate.adapters.cli.notices import (
    print_part,
    print_troubles,
    print_weakened,
    trips_line,
    unrecorded,
    validity_note,
)
from palpate.adapters.cli.options import CompareOptions
from palpate.adapters.cli.progress import progress
from palpate.adapters.experiments import (
    COMPARATORS,
    ChosenPolicy,
    RunFolder,
    comparators_of,
    open_rig,
    ready_pose,
    require_usable,
    run_chosen,
    run_toml,
    shown_interval,
    summary_of,
)
from palpate.adapters.log import aligned, csv_text


def compare(options: CompareOptions) -> int:
    """Run every strategy on the same trials and print their table; returns the exit code."""
    with ExitStack() as kept:
        return _compare(options, kept)


def _compare(options: CompareOptions, kept: ExitStack) -> int:
    """Into a folder that ``kept`` keeps other writers out of."""
    config = options.run
    folder = RunFolder(Path(options.out or f"runs/{config.scenario}-compare"))
    folder.require_free()
    chosen = [ChosenPolicy(name, config) for name in (*options.policy, *comparators_of(config))]
    ready = ready_pose(config)
    require_usable(config, ready)
    print_weakened(config)
    kept.enter_context(folder.writing())
    print_part(config)
    folder.write("run.toml", run_toml(config, "compare", trials=options.trials, policy=list(options.policy)))
    summaries: dict[str, dict[str, Any]] = {}
    finished = True
    with ExitStack() as opened:
        recorder = folder.recorder(config.recording, opened)
        # On every way out: what a log has lost is told beside the error that ended the run.
        if recorder is not None:
            kept.callback(print_troubles, recorder.troubles)
        for number, policy in enumerate(chosen):
            # Two runs may have folders of the same name, or one of a comparator's.
            taken = policy.label in summaries or (policy.label in COMPARATORS and policy.name not in COMPARATORS)
            logs = f"{policy.label}-{number}" if taken else policy.label
            with open_rig(config, ready) as rig, progress(options.trials, "trial", policy.label) as bar:
                rows = run_chosen(
                    policy, config, ready, rig, options.trials,
                    recorder=recorder, command="compare", subfolder=logs, on_trial=bar.update,
                )  # fmt: skip
            finished = len(rows) == options.trials
            if rows:
                summaries[policy.name if taken else policy.label] = summary_of(rows)
            if not finished:
                break
    table = comparison_table(summaries)
    foot = f"{config.arm}, scenario {config.scenario}, seed {config.seed}, {options.trials} trials each"
    foot += "\n" if finished else "; ended early\n"
    reasons = [f"{name}: {line}" for name, s in summaries.items() if (line := trips_line(s))]
    foot = "".join((*reasons, foot))
    foot += validity_note(config)
    folder.write("compare.txt", table + foot)
    folder.write("compare.csv", _csv(summaries))
    folder.write_json("summary.json", {"finished": finished, "policies": summaries})
    sys.stdout.write("\n" + table + foot + f"saved in {folder.path}\n")
    return int(unrecorded(recorder)) if finished else 130


def comparison_table(summaries: Mapping[str, Mapping[str, Any]]) -> str:
    """Success, times and forces, one strategy a line; intervals (95 %) in brackets, where one can be stated."""
    head = ("policy", "success", "median s", "95th percentile s", "peak N", "trips")
    lines = [head]
    for name, s in summaries.items():
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


def _csv(summaries: Mapping[str, Mapping[str, Any]]) -> str:
    columns = ("success", "median_s", "p95_s")
    header = ["policy", "trials", *(f"{c}{end}" for c in columns for end in ("", "_low", "_high"))]
    rows: list[list[Any]] = [[*header, "peak_force_N", "trips"]]
    for name, s in summaries.items():
        intervals = (s["success_95"], s["median_95_s"], s["p95_95_s"])
        values = [v for c, (low, high) in zip(columns, intervals, strict=True) for v in (s[c], low, high)]
        rows.append([name, s["trials"], *values, s["peak_force_N"], sum(s["trips"].values())])
    return csv_text(rows)
