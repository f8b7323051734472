"""A log tells whether the core, a port or something else raised the error that ended its trial."""

import pytest

from tests.golden.mishap import recorded
from tests.golden.mishaps import MISHAPS
from tests.unit.adapters.log.recording_bench import log_of


@pytest.mark.parametrize(
    ("name", "by"),
    [
        ("first-joints-invalid", "core"),
        ("first-kind", "core"),
        ("arm-gone", "port"),
        ("encoders-gone", "port"),
        ("aborted", "outside"),
        ("trip-invalid", ""),
    ],
)
def test_who_raised_what_ended_a_trial(name: str, by: str) -> None:
    end = log_of(recorded(MISHAPS[name])).end
    assert end is not None
    assert end.raised_by == by
