"""Looks at a study's cells before any is made: what can be refused now must not be refused in the night."""

import os
from itertools import islice
from typing import Final

from palpate.adapters.config import LEARNERS
from palpate.adapters.experiments.build import ready_pose, require_usable
from palpate.adapters.experiments.evaluation import ChosenPolicy
from palpate.adapters.experiments.fitting import configured_perception
from palpate.adapters.experiments.policies import learning_policy
from palpate.adapters.experiments.study.document import Study
from palpate.adapters.experiments.study.fields import with_learner

MOST_CHECKED: Final = 2000
"""Sets of settings that are looked at, at some milliseconds each; errors in others are reported when they are met."""


def require_possible(study: Study) -> None:
    """Make sure that the arm reaches what each set of settings needs, and that each policy serves it.

    Raises:
        ConfigurationError: A setting is refused, or does not go with the others.
    """
    for fields in islice(study.settings(), MOST_CHECKED):
        config = study.config(fields)
        ready = ready_pose(config)
        require_usable(config, ready)
        perception = configured_perception(config)
        for policy in study.policies:
            own = study.config(with_learner({**study.base, **fields}, policy, os.getcwd()))
            if policy not in LEARNERS:
                ChosenPolicy(policy, own)
            elif perception is not None:
                learning_policy(own, perception)
