from math import inf, nan
from typing import Any

import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.ports.rig import SensorFacts


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("noise_N", -0.1),
        ("noise_Nm", nan),
        ("range_N", (1.0, 0.0, 1.0)),
        ("range_Nm", (1.0, 2.0)),
        ("range_N", (1.0, nan, 1.0)),
        ("rate_Hz", inf),
        ("frame", ""),
    ],
)
def test_what_no_sensor_has_is_refused(name: str, value: Any) -> None:
    facts: dict[str, Any] = {"noise_N": 0.1, "noise_Nm": 0.004, name: value}
    with pytest.raises(ConfigurationError) as error:
        SensorFacts(**facts)
    assert error.value.field == f"force_sensor.facts.{name}"
