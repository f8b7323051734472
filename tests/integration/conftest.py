"""A training run that many tests look at."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.integration.command_line import QUICK, succeed


@pytest.fixture(scope="session")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a finished run of three trials; to be read, not changed."""
    out = tmp_path_factory.mktemp("trained") / "run"
    succeed("train", *QUICK, "--trials", 3, "--out", out)
    return out
