"""Pictures of reports: their descriptions say what the trials say."""

import io

from matplotlib.image import imread

from palpate.adapters.visualisation.report.policy_picture import policy_picture
from palpate.core.policy import (
    ActionEntry,
    LearnerEntry,
    PolicyDocument,
    QParameters,
    TableRow,
    TemperatureSchedule,
    compass_actions,
)

ACTIONS = tuple(ActionEntry.of(action) for action in compass_actions(0.7e-3))
PARAMETERS = QParameters(alpha=0.3, gamma=1.0, temperature=TemperatureSchedule(1.0, 1.0, 0.0))
NAMES = tuple(action.name for action in ACTIONS)
SIGNS = "-0+"
REGIONS = (
    *(f"x{x} y{y}" for x in SIGNS for y in SIGNS if (x, y) != ("0", "0")),
    *(f"tx{x} ty{y}" for x in SIGNS for y in SIGNS),
)


def row(state, action, visits=8):
    best = NAMES.index(action)
    q = tuple(-2.0 if n == best else -3.0 for n in range(len(NAMES)))
    return TableRow(state, "learned", action, best, q, (visits // len(NAMES),) * len(NAMES))


def policy(*table):
    state = {"q": [line.q for line in table], "visits": [line.visits_per_action for line in table]}
    learner = LearnerEntry("q-learning", PARAMETERS, state | {"trials_learned": 1})
    states = tuple(line.state for line in table)
    return PolicyDocument(
        created_with={}, perception={}, states=states, actions=ACTIONS, programmed={}, examples={}, learner=learner
    )


def pixels(png):
    return (imread(io.BytesIO(png), format="png") * 255).round().astype(int)[..., :3]


def test_policy_of_regions_is_two_maps():
    picture = policy_picture(policy(*(row(state, "+x") for state in REGIONS)))
    assert "x- y-: +x; x- y0: +x" in picture.alt
    height, width, _ = pixels(picture.png).shape
    # Three rows and seven columns: two maps of three by three, and a gap.
    assert width > 2 * height


def test_of_many_states_the_most_visited_are_drawn():
    table = [row(f"state {k}", "+y", visits=8 * (k + 1)) for k in range(60)]
    picture = policy_picture(policy(*table, row("never", "-x", visits=0)))
    assert "The 48 most visited of 61 states" in picture.caption
    assert "never" not in picture.alt
