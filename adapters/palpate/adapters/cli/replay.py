"""The ``palpate replay`` command."""

import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from palpate.adapters.cli.options import ReplayOptions
from palpate.adapters.cli.progress import progress
from palpate.adapters.config import RunConfig, overlay
from palpate.adapters.experiments import BASELINES, policy_named, third_party_entry
from palpate.adapters.log import aligned, find_logs
from palpate.adapters.replay import (
    Changes,
    Replay,
    Verdict,
    WhatIf,
    exit_code,
    explanation,
    parse_setting,
    replay_files,
)
from palpate.core.errors import ConfigurationError, LogError, OutputError
from palpate.core.policy import PolicyDocument, ThirdPartyEntry
from palpate.core.ports import CONTROL_RATE_HZ

_FEW: Final = 20
"""Maximum number of logs for which each log is listed; above it, only logs with differences are listed."""
_MOST_EXPLAINED: Final = 10


def replay(options: ReplayOptions) -> int:
    """Replay the logs and print a report; return the exit code."""
    if not options.logs:
        raise LogError("palpate replay", "", "no log was named", "name logs, folders of logs, or patterns in quotes")
    changes = read_changes(options)
    paths = find_logs(options.logs)
    out = Path(options.out) if options.out else None
    if out is not None and os.path.lexists(out):
        raise OutputError(options.out, "is there already", "name another folder with --out")
    # If the number of processes is given, each gets at least two logs; otherwise thirty, to justify its start-up time.
    jobs = min(options.jobs or os.cpu_count() or 1, -(-len(paths) // (2 if options.jobs else 30)))
    began = time.perf_counter()
    replays: list[Replay] = []
    with progress(len(paths), "log", passing=True) as bar:
        for part in replay_files(paths, WhatIf(changes, options.continue_in_mujoco, out), jobs):
            replays += part
            bar.update(len(part))
    seconds = time.perf_counter() - began
    report(replays, changes, verbose=options.verbose, strict=options.strict)
    if out is not None:
        sys.stdout.write(f"the continued trials are recorded in {out}\n")
    ticks = sum(one.ticks for one in replays)
    sys.stdout.write(
        f"{ticks} ticks, {ticks / CONTROL_RATE_HZ:.1f} s of trials in {seconds:.1f} s"
        f" with {jobs} process{'es' if jobs > 1 else ''}\n"
    )
    return exit_code(replays, strict=options.strict)


def read_changes(options: ReplayOptions) -> Changes:
    """Return the changes to the recording that the options request."""
    for setting in options.set:
        overlay(RunConfig(), parse_setting(setting))
    policy: PolicyDocument | ThirdPartyEntry | str | None = None
    if options.policy in BASELINES:
        policy = options.policy
    elif options.policy:
        document, code = policy_named(options.policy)
        policy = document or third_party_entry(code)
    changes = Changes(options.set, policy, options.policy)
    if (options.continue_in_mujoco or options.out) and not changes.any:
        flag = "--continue-in-mujoco" if options.continue_in_mujoco else "--out"
        raise ConfigurationError(flag, True, "given with --policy or --set, which make a what-if")
    return changes


def report(replays: Sequence[Replay], changes: Changes, *, verbose: bool, strict: bool) -> None:
    """Print a table, then explanations for the first logs with differences."""
    every = verbose or len(replays) <= _FEW
    shown = [one for one in replays if every or one.verdict is not Verdict.EQUAL]
    if shown:
        sys.stdout.write(table(shown, changes))
    explained = [one for one in shown if one.verdict is not Verdict.EQUAL or one.note]
    for one in explained[:_MOST_EXPLAINED]:
        sys.stdout.write(explanation(one, changes, strict=strict))
    if len(explained) > _MOST_EXPLAINED:
        sys.stdout.write(f"and {len(explained) - _MOST_EXPLAINED} more that are not equal\n")
    counts = ((verdict, sum(one.verdict is verdict for one in replays)) for verdict in Verdict)
    equal = sum(one.verdict is Verdict.EQUAL for one in replays)
    names = {Verdict.DIVERGED: "would have a different result"} if changes.any else {}
    others = "".join(
        f", {n} {names.get(verdict, verdict.value)}" for verdict, n in counts if n and verdict is not Verdict.EQUAL
    )
    sys.stdout.write(f"{equal} of {len(replays)} equal in every bit{others}\n")
    other = sum(one.verdict is Verdict.EQUAL and one.other_code for one in replays)
    if other:
        sys.stdout.write(f"{other} of them were recorded by different code of the core, with equal results\n")
    taken = [one for one in replays if one.recorded_decisions]
    if taken:
        sys.stdout.write(
            f"of {len(taken)} of them the decisions come from the log, and the rest was computed again: perception,"
            f" control, supervision and reinforcement; the policy's code is missing"
            f" ({taken[0].recorded_decisions})\n"
        )


def table(replays: Sequence[Replay], changes: Changes) -> str:
    """Return one line per log."""
    lines = [("log", "ticks", "recorded", "replayed", "result")]
    for one in replays:
        result = one.verdict.value
        if changes.any and one.counterfactual_from is not None:
            result = f"counterfactual from tick {one.counterfactual_from}"
        outcomes = (one.recorded_outcome or "-", one.replayed_outcome or "-")
        lines.append((one.path, str(one.ticks) if one.ticks else "-", *outcomes, result))
    return aligned(lines)
