"""Plans: what makes no sense is refused by name, in one line."""

import math
from typing import Any

import pytest

from palpate.adapters.fault_injection import FaultPlan
from palpate.core.errors import ConfigurationError

CASES: list[tuple[str, str, dict[str, Any], str, str]] = [
    ("dorp", "arm", {}, "kind = 'dorp'", "did you mean drop?"),
    ("xyz", "arm", {}, "kind", "one of drop, delay"),
    ("drop", "force-sensor", {}, "port", "did you mean force_sensor?"),
    ("stuck", "clock", {}, "port", "a port that has stuck: arm"),
    ("drop", "clock", {}, "port", "force_sensor or joint_encoder or arm"),
    ("drop", "force_sensor", {"magnitude": 2.0}, "magnitude", "no such setting for drop; it has probability"),
    ("disconnect", "arm", {"probability": 0.5}, "probability", "it has none"),
    ("spike", "force_sensor", {}, "magnitude", "spike would do nothing"),
    ("spike", "force_sensor", {"magnitude": math.inf}, "magnitude", "a number"),
    ("saturate", "force_sensor", {"magnitude": -3}, "magnitude", "a positive number"),
    ("saturate", "joint_encoder", {"magnitude": 3}, "port", "has saturate: force_sensor"),
    ("unit", "arm", {}, "factor", "unit would do nothing"),
    ("noise", "force_sensor", {"magnitude": -0.1}, "magnitude", "a positive number"),
    ("swap", "force_sensor", {"channels": (2,)}, "channels", "two different ones"),
    ("swap", "force_sensor", {"channels": (2, 2)}, "channels", "two different ones"),
    ("clock-jump", "clock", {}, "time_s", "clock-jump would do nothing"),
    ("overrun", "clock", {"time_s": -1}, "time_s", "a positive number"),
    ("delay", "arm", {"delay_ticks": 0}, "delay_ticks", "a whole number from 1"),
    ("repeat", "force_sensor", {"span_ticks": 0}, "span_ticks", "a whole number from 1"),
    ("nan", "force_sensor", {"channels": (6,)}, "channels", "from 0 to 5"),
    ("nan", "joint_encoder", {"channels": (-1,)}, "channels", "from 0 to"),
]


@pytest.mark.parametrize(("kind", "port", "settings", "field", "accepted"), CASES)
def test_nonsense_is_refused_by_name(kind: str, port: str, settings: dict[str, Any], field: str, accepted: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        FaultPlan(kind, port, **settings)
    assert str(caught.value).startswith(field)
    assert accepted in str(caught.value)
    assert "\n" not in str(caught.value)
