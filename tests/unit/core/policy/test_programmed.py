import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import Observation, compass_actions
from palpate.core.policy.programmed import ProgrammedPolicy

EIGHT = compass_actions(0.001)
STATES = ("left", "middle", "right")


def test_the_table_decides_whatever_its_order():
    policy = ProgrammedPolicy(STATES, EIGHT, {"right": "-x", "left": "+x"})
    assert [policy.assigned(state) for state in range(3)] == [0, None, 4]
    zero = (0.0, 0.0, 0.0)
    assert policy.choose(Observation(2, zero, zero, zero, zero, 0)).source == "programmed"


@pytest.mark.parametrize(
    ("table", "value", "accepted"),
    [
        ({"centre": "+x"}, "centre", "left, middle, right"),
        ({"left": "east"}, "east", "+x, +x+y, +y, -x+y, -x"),
    ],
)
def test_unknown_names_are_refused(table, value, accepted):
    with pytest.raises(ConfigurationError) as refused:
        ProgrammedPolicy(STATES, EIGHT, table)
    assert refused.value.field == "policy.programmed"
    assert refused.value.value == value
    assert accepted in refused.value.accepted


def test_an_empty_program_serves_nothing():
    policy = ProgrammedPolicy(STATES, EIGHT, {})
    assert not any(policy.serves(state) for state in range(3))
