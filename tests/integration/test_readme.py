"""What the README shows must work."""

import re
import tomllib
from pathlib import Path

import pytest

from palpate.adapters.config import RunConfig, overlay

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    found = re.search(rf"```{language}\n(.*?)```", README, re.DOTALL)
    assert found is not None
    return found.group(1)


def test_the_python_example_inserts_the_peg(capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(block("python"), "README.md", "exec"), {})
    assert "INSERTED" in capsys.readouterr().out


def test_the_toml_example_is_a_configuration() -> None:
    config = overlay(RunConfig(), tomllib.loads(block("toml")))
    assert config.cell.compliance.tilt_Nm_per_rad == 100.0
    assert config.learning.programmed == {"x+ y0": "-x"}


def test_every_link_leads_somewhere() -> None:
    links = re.findall(r"\]\(([^)#]+)\)", README)
    assert links
    assert [link for link in links if not link.startswith("http") and not (ROOT / link).exists()] == []
