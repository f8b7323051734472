"""A touch model is of one peg; another one's is refused, or taken as a beginning where that is asked."""

import numpy as np
import pytest

from palpate.adapters.config import overlay, scenario
from palpate.adapters.experiments import build_perception, learning_policy, loaded_policy, perception_of
from palpate.adapters.experiments.policies import perception_settings
from palpate.core.errors import ConfigurationError
from palpate.core.policy import Hindsight, PolicyDocument, document_of
from tests.unit.adapters.samples import observation

ROUND = scenario("blind", "belief")


@pytest.fixture(scope="module")
def learned():
    """The policy file of a belief after one trial."""
    perception = build_perception(ROUND)
    policy = learning_policy(ROUND, perception)
    policy.begin_trial(0, np.random.default_rng(0))
    for k in range(8):
        policy.choose(observation(2e-4 * k, 0.0))
    policy.end_trial(Hindsight(True, (1e-3, 0.0, 0.01), 0.01))
    made = document_of(policy, created_with={}, perception=perception_settings(ROUND, perception))
    return PolicyDocument.from_json_text(made.to_json_text())


def load(document, config):
    perception = perception_of(document, config, build_perception(config))
    return loaded_policy(document, config, perception, frozen=True)


@pytest.mark.parametrize(
    ("peg", "told"),
    [
        ({"cross_section": "square"}, "cell.peg.cross_section = 'square' is refused: 'round'"),
        ({"diameter_mm": 20.0}, "cell.peg.diameter_mm = 20.0 is refused: 29.0"),
        ({"chamfer_mm": 1.0}, "cell.peg.chamfer_mm = 1.0 is refused: 0.0"),
    ],
)
def test_a_touch_model_of_another_peg_is_refused_unless_it_is_asked_for(learned, peg, told):
    other = overlay(ROUND, {"cell": {"peg": peg}})
    with pytest.raises(ConfigurationError) as refused:
        load(learned, other)
    assert str(refused.value).startswith(told)
    assert "--learning.belief.other-tool" in str(refused.value)
    load(learned, overlay(other, {"learning": {"belief": {"other_tool": True}}}))
