"""Evaluate a policy on a rig. The policy, given by name or file, is checked before anything is built."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from palpate.adapters.config import RunConfig, task_kind
from palpate.adapters.experiments import policies
from palpate.adapters.experiments.build import plain_perception
from palpate.adapters.experiments.documents import save_policy
from palpate.adapters.experiments.figure import trials_picture
from palpate.adapters.experiments.fitting import configured_perception
from palpate.adapters.experiments.results import RunFolder, TrialRow
from palpate.adapters.experiments.statistics import Claim, run_summary
from palpate.adapters.experiments.trials import Trials
from palpate.adapters.log import core_sha256, made_with, processor
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.errors import ConfigurationError
from palpate.core.perception import Perception
from palpate.core.policy import Policy, PolicyDocument
from palpate.core.ports import Rig
from palpate.core.trial import TRIALS_OF_A_SERIES, ReadyPose, TrialReport

FIRST_EVALUATION_TRIAL: Final = TRIALS_OF_A_SERIES
"""Number of the first evaluation trial, chosen so that random streams differ from those of training."""


ORACLE_ON_RIG: Final = "one that does not need the true position of the hole, which is unknown on a rig"


class ChosenPolicy:
    """A policy that is checked before anything is built.

    Args:
        policy: Name of a baseline, path to a policy file, ``package.module:Name``, or a policy object.
    """

    def __init__(self, policy: str | os.PathLike[str] | Policy, config: RunConfig) -> None:
        self._config, self._policy = config, None if isinstance(policy, (str, os.PathLike)) else policy
        self.document: PolicyDocument | None = None
        self.perception: Perception
        if not isinstance(policy, (str, os.PathLike)):
            self.name = self.label = type(policy).__name__
            self.perception = configured_perception(config) or plain_perception(config)
            return
        name = self.name = policies.policy_for(config, os.fspath(policy))
        if self.name in (*policies.BASELINES, policies.NO_POLICY):
            self.label = config.task.name if self.name == policies.NO_POLICY else self.name
            self.perception = plain_perception(config)
            self._made(tuple)
            return
        self.label = Path(name).parent.name or Path(name).stem
        configured = configured_perception(config)
        self.document, code = policies.policy_named(name)
        if self.document is not None:
            self.perception = policies.perception_of(self.document, config, configured)
            self._made(tuple)
        elif configured is None:
            accepted = "a policy file of a training, which contains the perception that this configuration lacks"
            raise ConfigurationError("policy", name, accepted)
        else:
            self.label, self.perception = code.partition(":")[2], configured
            self.document = policies.third_party_document(code, config, configured)

    @property
    def is_object(self) -> bool:
        """True if the policy was given as an object."""
        return self._policy is not None

    @property
    def baseline(self) -> str:
        """Name of the policy if it cannot be stored in a policy file; otherwise an empty string."""
        return self.name if self.document is None else ""

    def on(self, rig: Rig) -> Policy:
        """Return the policy for trials on a rig, without learning."""
        return self._made(lambda: true_hole_m(rig))

    def _made(self, hole_m: policies.Hole) -> Policy:
        """Return the policy. It is also created once without a rig, so that errors appear before anything is built."""
        if self._policy is not None:
            return self._policy
        if self.document is None:
            return policies.baseline(self.name, self._config, hole_m)
        return policies.loaded_policy(self.document, self._config, self.perception, frozen=True)


def write_evaluation(
    config: RunConfig,
    folder: RunFolder,
    name: str,
    document: PolicyDocument | None,
    rows: Sequence[TrialRow],
    trials: int,
    claim: Claim | None = None,
) -> dict[str, Any]:
    """Write ``summary.json``, a plot of times and forces, and the policy; return the values in the summary."""
    summary = run_summary(config, rows, trials, policy=name)
    if claim is not None:
        verdict = claim.verdict(sum(row.success for row in rows), len(rows))
        summary |= {"claim": str(claim), "verdict": verdict}
    folder.write_json("summary.json", summary)
    who = config.task.name if name == policies.NO_POLICY else name
    folder.write("trials.png", trials_picture(rows, f"{who}, {config.scenario}", config.task.max_force_N))
    if document is not None:
        save_policy(document, folder.path / "policy.json")
    return summary


def true_hole_m(rig: Rig) -> Sequence[float]:
    """Return the true position and orientation of the hole in the form of :func:`pose_of`."""
    truth = rig.truth()
    if truth is None:
        raise ConfigurationError("policy", "oracle", ORACLE_ON_RIG)
    return policies.pose_of(truth.hole_in_task_m, truth.hole_turn_rad, truth.drawn)


def warm_up(config: RunConfig, ready: ReadyPose) -> TrialReport:
    """Run one complete trial in the simulator with separate objects, without affecting the run.

    This keeps late imports, cold caches and interpreter warm-up from delaying the first ticks of a real arm.
    """
    # The version data for all logs are collected once, which takes up to half a second and blocks other threads.
    for stated in (made_with, processor, core_sha256):
        stated()
    with SimulatedRig(config, ready) as rig:
        name = "torque" if task_kind(config.task.name).queries_policy else policies.NO_POLICY
        policy = policies.baseline(name, config, lambda: rig.truth().hole_in_task_m)
        return Trials(config, ready, rig, plain_perception(config), policy).run(0).report
