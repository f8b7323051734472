"""A recorded trial, and whether pictures can be drawn on this machine."""

from functools import cache
from pathlib import Path

import pytest

from palpate.adapters.mujoco.graphics import working_library
from palpate.core.errors import UsageError

GOLDEN = Path(__file__).parents[1] / "golden"
INSERTION = GOLDEN / "oracle-blind.mcap"
"""Zebra Zero, 297 ticks, hole 3 mm from at its nominal position; contact at tick 118, actions from 132 to 188."""


@cache
def _problem():
    try:
        working_library()
    except UsageError as error:
        return str(error)
    return ""


def require_graphics():
    """Skip the test where no graphics library draws off screen, as on machines that only run tests."""
    if _problem():
        pytest.skip(_problem())
