"""Claims: the number of trials they take, and the verdict."""

import pytest

from palpate.adapters.experiments import Claim
from palpate.core.errors import ConfigurationError


def test_as_many_trials_as_are_needed_prove_a_claim_and_one_fewer_does_not():
    claim = Claim.parse("success >= 0.99")
    assert claim.verdict(368, 368) == "proved"
    assert claim.verdict(367, 367) == "inconclusive"
    assert claim.verdict(367, 368) == "inconclusive"
    assert claim.verdict(350, 368) == "refuted"
    assert claim.verdict(0, 0) == "inconclusive"


@pytest.mark.parametrize("text", ["", "success", "success > 0.9", "success >= 1", "success >= 99", "time >= 0.5"])
def test_other_words_are_refused(text):
    with pytest.raises(ConfigurationError, match=r"success >= SHARE"):
        Claim.parse(text)
