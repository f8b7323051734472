"""Arms of one's own, by a table ``[arm]``: run, recorded, replayed, and refused in one line."""

import shutil
from pathlib import Path

import pytest

from palpate.core.motion import arm_named

ARM = '[arm]\nname = "bench"\nurdf = "bench.urdf"\nflange = "link_eef"\nposture_rad = [0, 0.1, 0, 0.65, 0, 0.55, 0]\n'


@pytest.fixture
def bench(tmp_path):
    (tmp_path / "arms").mkdir()
    shutil.copy(arm_named("xarm7").find_urdf(), tmp_path / "arms/bench.urdf")
    path = tmp_path / "arms/bench.toml"
    path.write_text(ARM)
    return path


def test_an_arm_of_ones_own_inserts_and_its_logs_replay_where_its_urdf_is(palpate, bench):
    printed = palpate.succeed("run", "--config", bench, "--policy", "torque", "--trials", 1, "--out", "out")
    assert "torque, bench, scenario paper, seed 0: 1 trial" in printed
    assert "outcomes: 1 inserted" in printed
    assert "1 of 1 equal in every bit" in palpate.succeed("replay", "out")
    (bench.parent / "bench.urdf").unlink()
    done = palpate("replay", "out")
    assert done.code == 2
    assert "no readable URDF (No such file or directory)" in done.stdout


def test_an_arm_by_name_in_a_file_may_have_other_limits(palpate):
    Path("arm.toml").write_text('[arm]\nname = "ur5e"\nvelocity_limit_rad_s = [1, 1, 1, 1, 1, 1]\n')
    printed = palpate.succeed("run", "--config", "arm.toml", "--policy", "torque", "--trials", 1, "--out", "out")
    assert "torque, ur5e, scenario paper" in printed
    assert 'urdf = "package://palpate/ur/ur5e.urdf"' in Path("out/run.toml").read_text()
    assert "1 of 1 equal in every bit" in palpate.succeed("replay", "out")
    Path("name.toml").write_text('[arm]\nname = "ur5e"\n')
    palpate.succeed("run", "--config", "name.toml", "--policy", "torque", "--trials", 1, "--out", "named")
    assert 'arm = "ur5e"' in Path("named/run.toml").read_text()
