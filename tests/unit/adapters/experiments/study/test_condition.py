import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from palpate.adapters.config import RunConfig, configured
from palpate.adapters.experiments.study import Condition, make
from palpate.adapters.experiments.study.condition import _one_thread
from palpate.core.errors import OutputError, PalpateError


def condition(policy, **fields):
    table = {"time_limit_s": 0.1, **fields}
    return Condition("it", fields, policy, configured(settings={"task": table, "recording": {"enabled": False}}), 1)


def test_what_fails_leaves_nothing(tmp_path):
    with pytest.raises(PalpateError, match="place"):
        make(condition("torque", goal={"x_mm": 1900.0}), tmp_path)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(OutputError, match="all workers need the folder"):
        make(condition("torque"), tmp_path / "elsewhere")


def test_of_two_that_make_the_same_condition_the_first_one_stays(tmp_path):
    (tmp_path / "it").mkdir()
    (tmp_path / "it" / "note").touch()
    with pytest.raises(OutputError, match="holds something already"):
        make(condition("torque"), tmp_path)
    (tmp_path / "it" / "summary.json").write_text("first")
    make(condition("torque"), tmp_path)
    assert (tmp_path / "it" / "summary.json").read_text() == "first"


def test_libraries_keep_to_one_thread():
    with threadpool_limits(2), _one_thread(RunConfig()):
        assert {library["num_threads"] for library in threadpool_info()} == {1}
