"""The torque rule that gives way now and then."""

import numpy as np
import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.policy import Observation, compass_actions
from palpate.core.ports import Vector3
from palpate.core.tasks.insertion_6dof import INSERTION_6DOF, GiveWay
from palpate.core.trial import TaskConfig

NONE: Vector3 = (0.0, 0.0, 0.0)


def test_the_first_three_actions_and_every_fifth_then_give_way() -> None:
    policy = GiveWay(INSERTION_6DOF.actions(TaskConfig()), 0.01)
    policy.begin_trial(0, np.random.default_rng(0))
    names = [
        policy.choose(Observation(0, NONE, NONE, NONE, (0.05, 0.0, 0.0), number)).action.name for number in range(13)
    ]
    assert names == ["give way"] * 3 + (["+y"] * 4 + ["give way"]) * 2


def test_an_action_set_without_giving_way_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="insertion-6dof"):
        GiveWay(compass_actions(1e-3), 0.01)
