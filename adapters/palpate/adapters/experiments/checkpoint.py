"""Where a training stands, and how it is resumed."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from palpate.adapters.config import RunConfig, overlay, read_toml, run_facts
from palpate.adapters.experiments.policies import first_difference
from palpate.adapters.experiments.results import RunFolder
from palpate.adapters.files import json_of_file
from palpate.adapters.log import LOG_FOLDER, made_with, set_aside
from palpate.core.errors import ConfigurationError, OutputError
from palpate.core.policy import Policy, learner_of
from palpate.core.ports import Rig


@dataclass(frozen=True)
class Checkpoint:
    """Where a training run stands.

    Attributes:
        learner: The learner's state after them.
        clock_ticks: Control ticks on the world's clock, which goes on from there.
    """

    next_trial: int
    learner: dict[str, Any]
    perception: dict[str, Any]
    clock_ticks: int

    def save(self, folder: RunFolder) -> None:
        """Write it into the folder, whole."""
        # After every trial: waiting for the disk would take a twentieth of a simulated one.
        folder.write_json("checkpoint.json", vars(self), durable=False)

    @classmethod
    def load(cls, folder: RunFolder) -> Checkpoint:
        """Read it back.

        Raises:
            OutputError: There is none, or it is damaged.
        """
        path = folder.path / "checkpoint.json"
        try:
            content = json_of_file(path)
            return cls(
                int(content["next_trial"]),
                dict(content["learner"]),
                dict(content["perception"]),
                int(content["clock_ticks"]),
            )
        except (OSError, ValueError, OverflowError, KeyError, TypeError) as error:
            raise OutputError(str(path), f"is no checkpoint to resume from ({error})", "begin a new run") from error


def resume_from(checkpoint: Checkpoint, policy: Policy, rig: Rig) -> None:
    """Put a policy's learner, and the world's clock, to where the checkpoint left them."""
    rig.set_clock_ticks(checkpoint.clock_ticks)
    learner = learner_of(policy)
    if learner is None:
        raise ConfigurationError("policy", type(policy).__name__, "a policy with a learner")
    try:
        learner.set_state(checkpoint.learner)
    except (KeyError, TypeError, ValueError) as error:
        raise OutputError("checkpoint.json", f"holds no state of this learner ({error})", "begin a new run") from error


def require_same_run(config: RunConfig, policy: str, folder: RunFolder) -> None:
    """Make sure that a folder's run began with this configuration, policy and software.

    Raises:
        ConfigurationError: It did not.
    """
    path = folder.path / "run.toml"
    table = read_toml(path)
    facts = run_facts(table, path)
    begun = {"policy": facts.get("policy"), "run.versions": facts.get("versions")}
    now = {"policy": policy, "run.versions": made_with()}
    settings = {"resume": asdict(config)}, {"resume": asdict(overlay(RunConfig(), table))}
    for ours, theirs in ((now, begun), settings):
        if ours != theirs:
            name, value, before = first_difference(ours, theirs)
            name = name.removeprefix("resume.")
            raise ConfigurationError(name, value, f"{before!r}, with which the run in {folder.path} began")


def cut_back(folder: RunFolder, first: int) -> None:
    """Remove from a folder what came after the checkpoint.

    Raises:
        OutputError: A trial before the checkpoint is missing.
    """
    folder.truncate(first)
    set_aside(folder.path / LOG_FOLDER, first)
    if len(folder.read_trials()) != first:
        missing = f"does not hold the {first} finished trials"
        raise OutputError(str(folder.path / "trials.csv"), missing, "begin a new run")
