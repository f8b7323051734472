"""Looks at a study's cells before any is made: what can be refused now must not be refused in the night."""

from __future__ import annotations

from itertools import islice
from typing import Final

from palpate.adapters.chosen_policy import ChosenPolicy
from palpate.adapters.composition import find_ready_pose, require_usable
from palpate.adapters.fitting import configured_perception
from palpate.adapters.policies import learning_policy
from palpate.adapters.study.cell import LEARN
from palpate.adapters.study.document import Study

MOST_CHECKED: Final = 2000
"""Sets of settings that are looked at, at some milliseconds each; what is wrong with others is told when it is met."""


def require_possible(study: Study) -> None:
    """Make sure that the arm reaches what each set of settings asks for, and that each policy serves it.

    Raises:
        ConfigurationError: A setting is refused, or does not go with the others.
    """
    for fields in islice(study.settings(), MOST_CHECKED):
        config = study.config(fields)
        ready = find_ready_pose(config)
        require_usable(config, ready)
        perception = configured_perception(config)
        for policy in study.policies:
            if policy != LEARN:
                ChosenPolicy(policy, config)
            elif perception is not None:
                learning_policy(config, perception)
