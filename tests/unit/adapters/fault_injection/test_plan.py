"""Plans and their TOML form: what makes no sense is refused by name, in one line."""

from __future__ import annotations

import tomllib

import pytest

from palpate.adapters.fault_injection import FaultPlan, fault_plans
from palpate.core.errors import ConfigurationError


def plans(text: str) -> list[FaultPlan]:
    return fault_plans(tomllib.loads(text))


def test_tables_become_plans() -> None:
    found = plans("""
        [[faults]]
        kind = "spike"
        port = "force_sensor"
        first_tick = 300
        duration_ticks = 20
        magnitude = 8
        probability = 0.1
        channels = [2, 3]
        seed = 5

        [[faults]]
        kind = "overrun"
        port = "clock"
        at_time_s = 2
        time_s = 0.03
    """)
    assert found == [
        FaultPlan("spike", "force_sensor", 300, None, 20, 0.1, magnitude=8.0, channels=(2, 3), seed=5),
        FaultPlan("overrun", "clock", at_time_s=2, time_s=0.03),
    ]


def test_no_tables_no_plans() -> None:
    assert plans("other = 1") == []


DROP = 'kind = "drop"\nport = "force_sensor"\n'
CASES = [
    ('kind = "dorp"\nport = "arm"', "faults[0].kind = 'dorp'", "did you mean drop?"),
    ('kind = "xyz"\nport = "arm"', "faults[0].kind", "one of drop, delay"),
    ('kind = "drop"\nport = "force-sensor"', "faults[0].port", "did you mean force_sensor?"),
    ('port = "arm"', "faults[0].kind = None", "one of drop"),
    ('kind = "drop"', "faults[0].port = None", "one of force_sensor"),
    ('kind = 3\nport = "arm"', "faults[0].kind = 3", "type str"),
    ('kind = "stuck"\nport = "clock"', "faults[0].port", "a port that knows stuck: arm"),
    ('kind = "drop"\nport = "clock"', "faults[0].port", "force_sensor or joint_encoder or arm"),
    (DROP + "first_tik = 3", "faults[0].first_tik", "did you mean first_tick?"),
    (DROP + "first_tick = -1", "faults[0].first_tick", "a whole number"),
    (DROP + "first_tick = 1.5", "faults[0].first_tick", "type int"),
    (DROP + "duration_ticks = -3", "faults[0].duration_ticks", "a whole number from 0"),
    (DROP + "probability = 1.5", "faults[0].probability", "from 0 to 1"),
    (DROP + "probability = nan", "faults[0].probability", "from 0 to 1"),
    (DROP + "seed = -1", "faults[0].seed", "a whole number"),
    (DROP + "at_time_s = nan", "faults[0].at_time_s", "a number"),
    (DROP + "at_time_s = true", "faults[0].at_time_s", "a number"),
    (DROP + 'at_time_s = "soon"', "faults[0].at_time_s", "a number"),
    (DROP + "at_time_s = 1.0\nfirst_tick = 2", "faults[0].at_time_s", "not both"),
    (DROP + "magnitude = 2.0", "faults[0].magnitude", "no such setting for drop; it knows probability"),
    ('kind = "disconnect"\nport = "arm"\nprobability = 0.5', "faults[0].probability", "it knows none"),
    ('kind = "spike"\nport = "force_sensor"', "faults[0].magnitude", "spike would do nothing"),
    ('kind = "spike"\nport = "force_sensor"\nmagnitude = inf', "faults[0].magnitude", "a number"),
    ('kind = "saturate"\nport = "force_sensor"\nmagnitude = -3', "faults[0].magnitude", "a positive number"),
    ('kind = "saturate"\nport = "joint_encoder"\nmagnitude = 3', "faults[0].port", "knows saturate: force_sensor"),
    ('kind = "unit"\nport = "arm"', "faults[0].factor", "unit would do nothing"),
    ('kind = "clock-jump"\nport = "clock"', "faults[0].time_s", "clock-jump would do nothing"),
    ('kind = "overrun"\nport = "clock"\ntime_s = -1', "faults[0].time_s", "a positive number"),
    ('kind = "delay"\nport = "arm"\ndelay_ticks = 0', "faults[0].delay_ticks", "a whole number from 1"),
    ('kind = "repeat"\nport = "force_sensor"\nspan_ticks = 0', "faults[0].span_ticks", "a whole number from 1"),
    ('kind = "nan"\nport = "force_sensor"\nchannels = [6]', "faults[0].channels", "from 0 to 5"),
    ('kind = "nan"\nport = "joint_encoder"\nchannels = [-1]', "faults[0].channels", "from 0 to"),
]


@pytest.mark.parametrize(("table", "field", "accepted"), CASES)
def test_nonsense_is_refused_by_name(table: str, field: str, accepted: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        plans(f"[[faults]]\n{table}")
    assert str(caught.value).startswith(field)
    assert accepted in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_number_of_the_table_is_told() -> None:
    with pytest.raises(ConfigurationError, match=r"faults\[1\]\.probability"):
        plans(f"[[faults]]\n{DROP}[[faults]]\n{DROP}probability = 2.0")


@pytest.mark.parametrize("text", ["faults = 3", "[faults]\nkind = 'drop'"])
def test_what_is_no_list_of_tables_is_refused(text: str) -> None:
    with pytest.raises(ConfigurationError, match=r"tables \[\[faults\]\]"):
        plans(text)


def test_an_entry_that_is_no_table_is_refused() -> None:
    with pytest.raises(ConfigurationError, match=r"faults\[0\] = 3"):
        plans("faults = [3]")
