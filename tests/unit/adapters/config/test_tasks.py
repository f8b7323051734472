"""Kinds of task are found by name, and what is none is refused in one line."""

import pytest

from palpate.adapters.config import RunConfig, overlay, task_kind, with_options
from palpate.core.errors import ConfigurationError
from palpate.core.tasks.insertion import INSERTION


def test_own_tasks_are_found_by_name() -> None:
    assert task_kind("insertion") is INSERTION
    assert not task_kind("surface-follow").asks_policy


def test_all_options_of_a_task_are_told_and_an_insertion_has_none() -> None:
    config = overlay(RunConfig(), {"task": {"name": "insertion-6dof", "options": {"corners": 4.0}}})
    told = with_options(config).task.options
    assert (told["corners"], told["down_share"]) == (4.0, 0.9)
    assert with_options(RunConfig()) == RunConfig()


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("insertoin", "did you mean insertion?"),
        ("x", "one of hole-survey, insertion, insertion-6dof, surface-follow"),
        ("math:pi", "a palpate.core.trial.TaskKind; math:pi has no preset"),
        ("no_such_package:KIND", "No module named 'no_such_package'"),
    ],
)
def test_what_is_no_kind_of_task_is_refused(name: str, told: str) -> None:
    with pytest.raises(ConfigurationError, match=r"task\.name") as refused:
        task_kind(name)
    assert told in str(refused.value)
    assert "\n" not in str(refused.value)
