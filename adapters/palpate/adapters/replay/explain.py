"""What the replay of a log came to, in words and as an exit code."""

from __future__ import annotations

from collections.abc import Sequence

from palpate.adapters.replay.engine import Replay, Verdict
from palpate.adapters.replay.rebuild import Changes


def exit_code(replays: Sequence[Replay], problems: Sequence[str], *, strict: bool) -> int:
    """0: all equal; 1: something differs; 2: nothing differs, but a log could not be replayed."""
    verdicts = {one.verdict for one in replays}
    if Verdict.DIVERGED in verdicts or problems or (strict and Verdict.NOT_BIT_COMPARABLE in verdicts):
        return 1
    return 2 if Verdict.REFUSED in verdicts else 0


def explanation(one: Replay, changes: Changes, *, strict: bool) -> str:
    """What differs, and why as far as it is known; one line."""
    if one.verdict is Verdict.REFUSED:
        return f"{one.problem}\n"
    text = f"{one.path}: "
    if one.first is not None:
        text += str(one.first)
        if one.differences > 1:
            text += f" (and {one.differences - 1} more)"
        causes = [*_changes_told(changes), *one.causes]
        text += (
            f"; known to be other: {', '.join(causes)}" if causes else "; no cause is known: same code, same versions"
        )
        if one.verdict is Verdict.NOT_BIT_COMPARABLE:
            text += "; decisions are equal and numbers within 1e-9" + (" (--strict: a failure)" if strict else "")
    if one.note:
        text += ("; " if one.first is not None else "") + one.note
    return text + "\n"


def _changes_told(changes: Changes) -> list[str]:
    told = list(changes.settings)
    if changes.policy is not None:
        told.append(f"policy {changes.policy_name}")
    if changes.config is not None:
        told.append("the configuration given")
    return told
