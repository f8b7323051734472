"""A log tells whether the core, a port or something else raised the error that ended its trial."""

import pytest

from tests.golden.fault_scenario import recorded
from tests.golden.scenarios import SCENARIOS
from tests.unit.adapters.log.recording_bench import log_of


@pytest.mark.parametrize(
    ("name", "by"),
    [
        ("first-joints-invalid", "core"),
        ("first-kind", "core"),
        ("force-sensor-gone", "port"),
        ("encoders-gone", "port"),
        ("aborted", "outside"),
        ("trip-invalid", ""),
    ],
)
def test_who_raised_what_ended_a_trial(name: str, by: str) -> None:
    end = log_of(recorded(SCENARIOS[name])).end
    assert end is not None
    assert end.raised_by == by
