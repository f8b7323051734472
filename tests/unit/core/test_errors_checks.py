"""Checks of settings: what is refused, and what the refusal says."""

import importlib
import pickle

import pytest

from palpate.core import errors
from palpate.core.errors import ConfigurationError, require_one_of


def test_long_value_is_cut_short_in_the_message():
    with pytest.raises(ConfigurationError) as caught:
        require_one_of("a.b", "x" * 1000, ("disc",))
    assert len(str(caught.value)) < 150
    assert caught.value.value == "x" * 1000


ERRORS = [
    errors.ConfigurationError("task.step_mm", 9, "at most 8"),
    errors.OutputError("runs/a", "holds a run", "choose another folder"),
    errors.LogError("a.mcap", "tick 3", "cut off", "record it again"),
    errors.LifecycleError("arm", "closed", "send", "open it first"),
    errors.CommandError("not finite", float("inf")),
    errors.UndeterminedError("friction", "no slide", "a slide"),
    errors.PolicyError("mine:Policy", "no action"),
    errors.FaultLatchedError("arm", "silence"),
]


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_error_passes_between_processes(error):
    """A pool waits for ever for a worker whose error cannot be read."""
    copied = pickle.loads(pickle.dumps(error))
    assert (type(copied), str(copied), vars(copied)) == (type(error), str(error), vars(error))


def test_place_of_an_error_is_in_the_package_that_was_called_and_not_in_the_libraries_that_it_uses(
    tmp_path, monkeypatch
):
    (tmp_path / "own_policy.py").write_text("import own_library\n\n\ndef act():\n    own_library.fail()\n")
    (tmp_path / "own_library.py").write_text("def fail():\n    {}['key']\n")
    code = "def call(function):\n    function()\n"
    caller = {"__name__": "palpate.core.caller"}
    exec(code, caller)
    monkeypatch.syspath_prepend(str(tmp_path))
    act = importlib.import_module("own_policy").act
    with pytest.raises(KeyError) as caught:
        caller["call"](act)
    # This test is no caller of palpate's.
    error = caught.value.with_traceback(caught.tb.tb_next)
    assert errors.describe(error) == "KeyError: 'key' (own_policy.py:5)"
    assert errors.describe(KeyError("key")) == "KeyError: 'key'"
