"""Arrows point where the policy goes, and Q values stand where they belong."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.adapters.visualisation.report.policy_pictures import arrows_pictures, q_picture
from tests.unit.adapters.visualisation.report.samples import NAMES, POSITION, TORQUE, pixels, policy, row


def head_of_arrow(action: str) -> tuple[float, float]:
    """From the middle of the arrow to its head, where it is widest; right and down are positive."""
    (picture,) = arrows_pictures("p", policy(row("s", action)), "a policy")
    dark = pixels(picture.png).sum(axis=-1) < 60
    dark[: dark.shape[0] // 4] = dark[-dark.shape[0] // 4 :] = False
    lines, columns = np.nonzero(dark)
    middle = (columns.min() + columns.max()) / 2, (lines.min() + lines.max()) / 2
    return float(columns.mean() - middle[0]), float(lines.mean() - middle[1])


@pytest.mark.parametrize("action", NAMES)
def test_arrows_point_as_the_action_goes(action: str) -> None:
    found = dict(zip("xy", head_of_arrow(action), strict=True))
    for axis in "xy":
        if f"+{axis}" in action:
            assert found[axis] > 3
        elif f"-{axis}" in action:
            assert found[axis] < -3
        else:
            assert abs(found[axis]) < 2


def test_an_action_that_leads_nowhere_is_named() -> None:
    document = policy(row("s", "+x"))
    skills = replace(document, actions=tuple(replace(each, displacement_mm=(0.0, 0.0)) for each in document.actions))
    (arrow,), (name,) = (arrows_pictures("p", each, "t") for each in (document, skills))
    assert ("Arrows" in arrow.caption, "Bold: the best action" in name.caption) == (True, True)
    assert "Arrows" not in name.caption
    assert arrow.png != name.png
    dark = pixels(name.png).sum(axis=-1) < 60
    third = dark.shape[0] // 3
    assert dark[third : 2 * third].any()


def test_two_maps_and_what_they_say() -> None:
    document = policy(*(row(state, "-x+y", -1.0 - n) for n, state in enumerate((*POSITION, *TORQUE))))
    position, torque = arrows_pictures("policy", document, "q-learning")
    assert (position.name, torque.name) == ("policy-position-regions", "policy-torque-regions")
    assert "x- y-: -x+y" in position.alt
    assert "tx+ ty+: -x+y" in torque.alt
    assert "tx" not in position.alt
    assert "Seen from above" in position.caption


def test_an_untried_best_action_is_no_knowledge() -> None:
    line = row("s", "+y")
    visits = tuple(0 if n == line.best else 4 for n in range(8))
    (known,) = arrows_pictures("p", policy(line), "t")
    (untried,) = arrows_pictures("p", policy(replace(line, visits_per_action=visits)), "t")
    assert "Untried" in untried.caption
    assert "Untried" not in known.caption
    assert known.png != untried.png


def test_a_state_without_knowledge_has_no_arrow() -> None:
    (picture,) = arrows_pictures("p", policy(row("s", "+y", visits=0)), "t")
    assert "Nothing was learned" in picture.alt
    dark = pixels(picture.png).sum(axis=-1) < 60
    (arrow,) = arrows_pictures("p", policy(row("s", "+y")), "t")
    assert dark.sum() < 0.6 * (pixels(arrow.png).sum(axis=-1) < 60).sum()


def test_what_was_programmed_is_called_so() -> None:
    (picture,) = arrows_pictures("p", policy(row("s", "+y", visits=0, source="programmed"), row("t", "-x")), "t")
    assert "Not learned: programmed." in picture.caption
    assert "s: +y; t: -x" in picture.alt


def test_q_values() -> None:
    picture = q_picture("q", policy(row("a", "+x", -1.5), row("b", "-y", -3.0)), "q-learning")
    assert picture is not None
    assert "2 states by 8 actions, from -4.00 (state b, action +x) to -1.50. 0 pairs never tried." in picture.alt


def test_q_values_never_tried_are_not_shown_as_numbers() -> None:
    line = row("a", "+x", -1.5)
    document = policy(replace(line, visits_per_action=(1, 1, 1, 1, 1, 1, 1, 0)), row("b", "+x", visits=0))
    picture = q_picture("q", document, "t")
    assert picture is not None
    # The state that was never visited is left out.
    assert "1 state by 8 actions" in picture.alt
    assert "1 pair never tried." in picture.alt
