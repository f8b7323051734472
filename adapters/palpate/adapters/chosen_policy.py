"""A policy by name or file, checked before anything is built, and then put to work on a rig."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from palpate.adapters.composition import build_perception
from palpate.adapters.config import RunConfig
from palpate.adapters.fitting import configured_perception
from palpate.adapters.policies import COMPARATORS, comparator, loaded_policy, perception_of
from palpate.adapters.rig import Rig
from palpate.core.errors import ConfigurationError
from palpate.core.perception import Perception
from palpate.core.policy import Policy, PolicyDocument

NOBODY_KNOWS: Final = "a policy that need not know where the hole is, on a real rig"


class ChosenPolicy:
    """A policy by name or file, checked before anything is built.

    Args:
        name: A comparator's name, or the path of a policy file.
        config: The run's configuration.

    Attributes:
        label: Short name for tables.
        document: The policy file; None for a comparator.
        perception: From signals to states.
    """

    def __init__(self, name: str, config: RunConfig) -> None:
        self.name, self._config = name, config
        self.document: PolicyDocument | None = None
        self.perception: Perception
        if name in COMPARATORS:
            self.label = name
            self.perception = build_perception(RunConfig(task=config.task))
        else:
            self.label = Path(name).parent.name or Path(name).stem
            if not os.path.exists(name):
                raise ConfigurationError("policy", name, f"a policy file, or one of {', '.join(COMPARATORS)}")
            self.document = PolicyDocument.load(Path(name))
            self.perception = perception_of(self.document, config, configured_perception(config))

    def on(self, rig: Rig) -> Policy:
        """The policy at work on a rig; it does not learn."""
        if self.document is None:
            return comparator(self.name, self._config, lambda: true_hole_m(rig))
        return loaded_policy(self.document, self._config, self.perception, frozen=True)


def true_hole_m(rig: Rig) -> Sequence[float]:
    """Where the hole really is.

    Raises:
        ConfigurationError: Nobody knows.
    """
    truth = rig.truth()
    if truth is None:
        raise ConfigurationError("policy", "omniscient", NOBODY_KNOWS)
    return truth.hole_in_task_m
