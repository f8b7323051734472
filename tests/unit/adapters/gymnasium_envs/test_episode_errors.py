"""Errors are ours and Gymnasium's, and survive the way from a worker process."""

from __future__ import annotations

import pickle

import gymnasium.error
import pytest

from palpate.adapters.gymnasium_envs.episode import ActionRefusedError, NotRunningError, refuse_unknown
from palpate.core.errors import CommandError, ConfigurationError, LifecycleError


def test_either_family_catches_them() -> None:
    refused, idle = ActionRefusedError("action 9 is refused", 9), NotRunningError("no episode runs")
    assert isinstance(refused, CommandError)
    assert isinstance(refused, gymnasium.error.InvalidAction)
    assert isinstance(idle, LifecycleError)
    assert isinstance(idle, gymnasium.error.ResetNeeded)


@pytest.mark.parametrize("error", [ActionRefusedError("action 9 is refused", 9), NotRunningError("no episode runs")])
def test_a_worker_can_send_them_and_the_parent_makes_them_anew(error: Exception) -> None:
    arrived = pickle.loads(pickle.dumps(error))
    assert (type(arrived), str(arrived)) == (type(error), str(error))
    assert str(type(error)(arrived)) == str(error)


def test_an_unknown_argument_is_named_and_so_are_those_that_there_are() -> None:
    refuse_unknown("x-v0", {}, ("size",))
    with pytest.raises(ConfigurationError) as caught:
        refuse_unknown("x-v0", {"sise": 7}, ("map", "size"))
    assert str(caught.value) == "sise = 7 is refused: no such argument of x-v0; there are map, size"
