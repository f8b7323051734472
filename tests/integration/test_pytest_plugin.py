"""``pytest --palpate-logs DIR`` in a repository of its own."""

import shutil
import subprocess
import sys
from types import SimpleNamespace

import pytest

from palpate.adapters.replay import pytest_plugin
from tests.support.log_surgery import changed, indices, messages_of, one_ulp, write_log


def run_pytest(laboratory, *words):
    call = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *map(str, words)]
    return subprocess.run(call, cwd=laboratory, capture_output=True, text=True, check=False, timeout=120)


@pytest.fixture
def laboratory(tmp_path, golden_here):
    """Someone's repository with two recorded trials and no tests of its own."""
    (tmp_path / "trials").mkdir()
    for name in ("train-paper", "torque-ur5"):
        shutil.copy(golden_here(name), tmp_path / "trials")
    return tmp_path


def test_every_log_is_a_test_beside_others_and_one_that_differs_fails_in_one_line(laboratory):
    (laboratory / "test_own.py").write_text("def test_own():\n    pass\n")
    sound = laboratory / "trials" / "torque-ur5.mcap"
    messages = messages_of(sound)
    altered = changed(messages, indices(messages, "/tick")[20], one_ulp("requested_rad", 1))
    write_log(laboratory / "trials" / "altered.mcap", altered)
    (laboratory / "trials" / "torn.mcap").write_bytes(sound.read_bytes()[:5000])
    done = run_pytest(laboratory, "--palpate-logs", "trials", "-v")
    assert done.returncode == 1
    assert "2 failed, 3 passed" in done.stdout
    assert "trials/train-paper.mcap PASSED" in done.stdout
    assert "altered.mcap: tick 20, /tick requested_rad[1]: recorded" in done.stdout
    assert "torn.mcap: " in done.stdout
    assert "Traceback" not in done.stdout


def test_folder_that_is_not_there_is_a_wrong_call(request):
    config = SimpleNamespace(getoption={"palpate_logs": ["nowhere"]}.get)
    with pytest.raises(pytest.UsageError, match="--palpate-logs: nowhere: is not there"):
        pytest_plugin.pytest_collection_modifyitems(request.session, config, [])
