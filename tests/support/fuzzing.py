"""What the fuzz targets share."""

from pathlib import Path

CORPORA = Path(__file__).parents[1] / "fuzz"


def require(condition, what):
    if not condition:
        raise AssertionError(what)
