"""What the folder of a run holds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from palpate.adapters.experiments import TrialRow
from palpate.adapters.visualisation.report.files import is_there, read_json, read_run_toml, read_trials
from palpate.adapters.visualisation.report.learning_pictures import LearningCurve
from palpate.core.errors import OutputError
from palpate.core.policy import PolicyDocument

LATE: Final = 25
"""Trials at the end of a run that learns which stand for what it has learned."""


@dataclass(frozen=True)
class RunSource:
    """The content of a run's folder.

    Attributes:
        settings: Its configuration; empty where it is not kept.
        facts: How it was called; empty where it is not kept.
        summary: ``summary.json``; empty while the run is unfinished.
        document: Its policy file; None where no file can hold the policy, or while the run is unfinished.
    """

    path: Path
    rows: tuple[TrialRow, ...]
    settings: dict[str, Any]
    facts: dict[str, Any]
    summary: dict[str, Any]
    document: PolicyDocument | None

    @classmethod
    def read(cls, path: Path) -> RunSource:
        """Read a folder."""
        rows = read_trials(path)
        if not rows:
            raise OutputError(str(path), "holds no finished trial", "there is nothing to report yet")
        settings, facts = read_run_toml(path)
        summary = read_json(path / "summary.json") if is_there(path / "summary.json") else {}
        return cls(path, rows, settings, facts, summary, policy_in(path / "policy.json"))

    @cached_property
    def learns(self) -> bool:
        """Whether its policy changed from trial to trial."""
        command = self.facts.get("command")
        if command in ("train", "run"):
            return bool(command == "train")
        # It is not recorded: a temperature that falls belongs to a learner.
        return len({row.temperature for row in self.rows}) > 1

    @property
    def late(self) -> tuple[TrialRow, ...]:
        """The trials that stand for it: all, or of a run that learns the last 25, at most half of them."""
        return self.rows[-min(LATE, max(1, len(self.rows) // 2)) :] if self.learns else self.rows

    @property
    def missing(self) -> int:
        """Trials that were asked for and have not been made."""
        asked = self.facts.get("trials")
        return max(0, asked - len(self.rows)) if isinstance(asked, int) else 0

    @property
    def policy(self) -> str:
        """Name of the policy."""
        return str(self.facts.get("policy", "unknown"))


def curve_of(label: str, runs: list[tuple[TrialRow, ...]]) -> LearningCurve:
    """A curve of equal runs with different seeds."""
    return LearningCurve(
        label,
        tuple(tuple(row.exploration_time_s for row in rows) for rows in runs),
        tuple(tuple(row.success for row in rows) for rows in runs),
    )


def policy_in(path: Path) -> PolicyDocument | None:
    """A policy file; None where there is none."""
    return PolicyDocument.load(path) if is_there(path) else None
