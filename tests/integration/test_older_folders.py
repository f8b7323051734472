"""Run folders that palpate 0.1.0 left, before its modules moved: they are replayed, reported and gone on with."""

import re
import shutil
from pathlib import Path

import pytest

from palpate.adapters.cli.main import main
from palpate.adapters.log.provenance import made_with

BEFORE = Path(__file__).parents[1] / "golden" / "before"


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """A copy of the run of three trials, made with the versions of the packages that are installed here."""
    copy = tmp_path / "run"
    shutil.copytree(BEFORE / "run", copy)
    recipe = copy / "run.toml"
    text = recipe.read_text()
    for name, version in made_with().items():
        text = re.sub(rf"^{re.escape(name)} = .*$", f'{name} = "{version}"', text, flags=re.MULTILINE)
    recipe.write_text(text)
    return copy


@pytest.mark.parametrize(("folder", "trials"), [("run", 3), ("rig-run", 1)])
def test_it_replays_equal_in_every_bit(folder: str, trials: int, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(BEFORE / folder)]) == 0
    assert f"{trials} of {trials} " in capsys.readouterr().out


@pytest.mark.parametrize("folder", ["run", "rig-run"])
def test_it_gets_a_report(folder: str, tmp_path: Path) -> None:
    copy = tmp_path / folder
    shutil.copytree(BEFORE / folder, copy)
    assert main(["report", str(copy)]) == 0
    assert (copy / "report.html").stat().st_size > 10_000


def test_it_goes_on_as_it_would_have_then(run: Path) -> None:
    words = ["--scenario", "paper", "--seed", "7", "--task.time-limit-s", "2", "--out", str(run)]
    assert main(["train", "--resume", "--trials", "4", *words]) == 0
    expected = BEFORE / "after-one-more"
    for name in ("trials.csv", "decisions.csv", "policy.json"):
        assert (run / name).read_bytes() == (expected / name).read_bytes(), name
