"""What ``summary.json`` says of a run, whichever command made it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from palpate.adapters.config.run import RunConfig
from palpate.adapters.experiments.results import TrialRow
from palpate.adapters.experiments.statistics import learning_summary, summary_of
from palpate.core.insertion.frame import reachable_share


def training_summary(config: RunConfig, rows: Sequence[TrialRow], trials: int) -> dict[str, Any]:
    """Figures of a training run of which so many trials were asked."""
    return {
        "scenario": config.scenario,
        "arm": config.arm,
        "seed": config.seed,
        "finished": len(rows) >= trials,
        **summary_of(rows),
        "learning": learning_summary(rows),
        "holes_inside_area": round(reachable_share(config.task, config.cell.hole_uncertainty_mm), 4),
    }


def policy_summary(config: RunConfig, policy: str, rows: Sequence[TrialRow], trials: int) -> dict[str, Any]:
    """Figures of a run of a policy that does not learn."""
    return {
        "policy": policy,
        "scenario": config.scenario,
        "arm": config.arm,
        **summary_of(rows),
        "finished": len(rows) == trials,
    }
