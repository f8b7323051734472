"""Settings that are fine by themselves and impossible together are refused by name."""

import pytest

from palpate.adapters.config import RunConfig, overlay
from palpate.core.errors import ConfigurationError


@pytest.mark.parametrize(
    ("table", "field"),
    [
        ({"cell": {"hole_height_error_mm": 4.0}}, "cell.hole_height_error_mm"),
        ({"cell": {"peg": {"hole_depth_mm": 5.0}}}, "cell.peg.hole_depth_mm"),
        ({"task": {"insertion_depth_mm": 11.0}}, "cell.peg.hole_depth_mm"),
    ],
)
def test_what_no_trial_could_do_is_refused(table: dict[str, object], field: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        overlay(RunConfig(), table)
    assert caught.value.field == field
