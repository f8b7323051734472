import pytest

from palpate.core.policy.examples import ExamplesPolicy
from tests.unit.core.policy.bench import EIGHT, observation, refuse

NAMES = [action.name for action in EIGHT]
STATES = ("a", "b", "c")


def test_the_majority_decides_and_ties_go_to_the_first_action():
    shown = [("a", "-y"), ("a", "+y"), ("a", "-y"), ("b", "-x"), ("b", "+x")]
    policy = ExamplesPolicy(STATES, EIGHT, shown)
    assert [policy.assigned(state) for state in range(3)] == [NAMES.index("-y"), NAMES.index("+x"), None]
    assert policy.choose(observation(0)).source == "examples"


@pytest.mark.parametrize("pair", [("d", "+x"), ("a", "east")])
def test_unknown_names_are_refused(pair):
    refuse("policy.examples", ExamplesPolicy, STATES, EIGHT, [pair])
