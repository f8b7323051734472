"""Replay many logs in several processes."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from palpate.adapters.config import RecordingConfig, folder_kept
from palpate.adapters.experiments import in_processes
from palpate.adapters.log import TrialRecorder, names_for, read_log
from palpate.adapters.replay.engine import Replay, Verdict, replay
from palpate.adapters.replay.rebuild import Changes, Rebuilder
from palpate.core.errors import LogError, OutputError, PalpateError, one_line, require_whole

_MOST_JOBS: Final = 1024


def replay_file(
    path: Path, rebuilder: Rebuilder, *, in_mujoco: bool = False, out: tuple[TrialRecorder, str] | None = None
) -> Replay:
    """Replay one log. Problems with the log are returned as results instead of being raised."""
    try:
        with folder_kept():
            return replay(read_log(path), rebuilder, in_mujoco=in_mujoco, out=out)
    except LogError as error:
        return Replay(str(path), Verdict.REFUSED, problem=one_line(error))
    except PalpateError as error:
        return Replay(str(path), Verdict.REFUSED, problem=f"{path}: {one_line(error)}")


@dataclass(frozen=True)
class WhatIf:
    """Changes to the replays in a batch, whether the simulator continues them, and the folder for their logs."""

    changes: Changes = field(default_factory=Changes)
    in_mujoco: bool = False
    out: Path | None = None


def replay_files(paths: Sequence[Path], what_if: WhatIf, jobs: int) -> Iterator[list[Replay]]:
    """Replay logs in groups, in order. The results do not depend on the number of processes.

    Raises:
        ConfigurationError: ``jobs`` is not between 1 and 1024.
    """
    require_whole("jobs", jobs, 1, _MOST_JOBS)
    # Long groups, because a model-based learner is fitted again in each of them.
    size = max(1, -(-len(paths) // (4 * jobs)))
    named = list(zip(paths, names_for(paths), strict=True))
    parts = [named[i : i + size] for i in range(0, len(named), size)]
    if jobs == 1:
        rebuilder = Rebuilder(what_if.changes)
        yield from (_replay_part(part, what_if, rebuilder) for part in parts)
        return
    yield from in_processes(_replay_part, ((part, what_if) for part in parts), jobs)


def _replay_part(part: Sequence[tuple[Path, str]], what_if: WhatIf, rebuilder: Rebuilder | None = None) -> list[Replay]:
    rebuilder = rebuilder or Rebuilder(what_if.changes)
    with ExitStack() as opened:
        recorder = None if what_if.out is None else TrialRecorder.into(what_if.out, RecordingConfig())
        if recorder is not None:
            opened.enter_context(recorder)
        replays = [
            replay_file(
                path, rebuilder, in_mujoco=what_if.in_mujoco, out=None if recorder is None else (recorder, name)
            )
            for path, name in part
        ]
    if recorder is not None and recorder.losses:
        raise OutputError(str(what_if.out), recorder.losses[0], "nothing was overwritten")
    return replays


def exit_code(replays: Sequence[Replay], *, strict: bool) -> int:
    """Return 0 if all are identical, 1 if any differs, 2 if none differs but a log could not be replayed to its end."""
    verdicts = {one.verdict for one in replays}
    if Verdict.DIVERGED in verdicts or (strict and Verdict.NOT_BIT_COMPARABLE in verdicts):
        return 1
    return 2 if verdicts & {Verdict.REFUSED, Verdict.CUT_SHORT} else 0


def explanation(one: Replay, changes: Changes, *, strict: bool) -> str:
    """Return the differences and their known causes on one line."""
    if one.verdict is Verdict.REFUSED:
        return f"{one.problem}\n"
    text = f"{one.path}: "
    if one.first is not None:
        text += str(one.first)
        if one.differences > 1:
            text += f" (and {one.differences - 1} more)"
        policies = () if changes.policy is None else (f"policy {changes.policy_name}",)
        causes = [*changes.settings, *policies, *one.causes]
        text += (
            f"; known to be other: {', '.join(causes)}" if causes else "; no cause is known: same code, same versions"
        )
        if one.verdict is Verdict.NOT_BIT_COMPARABLE:
            text += "; decisions are equal and numbers within 1e-9" + (" (--strict: a failure)" if strict else "")
    if one.note:
        text += ("; " if one.first is not None else "") + one.note
    return text + "\n"
