from palpate.adapters.visualisation.report.touch_pictures import touch_pictures
from palpate.core.policy import LearnerEntry
from palpate.core.policy.belief import BeliefParameters
from tests.unit.core.policy.belief.simulated_touch import trials


def _belief(count: int) -> LearnerEntry:
    return LearnerEntry(
        "belief", BeliefParameters(), {"trials": [trial.to_dict() for trial in trials(count)], "trials_learned": count}
    )


def test_a_touch_model_is_drawn_with_its_figures() -> None:
    (picture,) = touch_pictures("touch-x", _belief(30), "run x")
    assert picture.png.startswith(b"\x89PNG")
    assert "240 touches of 30 trials" in picture.caption
    assert "torque 20 N mm at most" in picture.alt or "torque 21 N mm at most" in picture.alt


def test_nothing_learned_gives_no_picture() -> None:
    assert touch_pictures("touch-x", _belief(0), "run x") == ()
