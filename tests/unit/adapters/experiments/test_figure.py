"""The learning curve is a picture that opens, and equal trials give equal pictures."""

import io
from contextlib import contextmanager

import pytest
from matplotlib.image import imread

from palpate.adapters.experiments import figure, learning_curve
from palpate.adapters.experiments.tables import render_table
from palpate.core.policy import document_of
from palpate.core.policy.base import Transition, compass_actions
from palpate.core.policy.exploration import TemperatureSchedule
from palpate.core.policy.programmed import MixedPolicy, ProgrammedPolicy
from palpate.core.policy.tabular import QLearning, QParameters
from tests.unit.adapters.samples import trial_rows

SIZE = (504, 960, 3)


def pixels(png):
    return (imread(io.BytesIO(png), format="png") * 255).round().astype(int)[..., :3]


@pytest.mark.parametrize("trials", [0, 1])
def test_hardly_any_trials_still_give_a_picture(trials):
    assert pixels(learning_curve(trial_rows(*[3.0] * trials), "few")).shape == SIZE


def test_times_and_forces_of_a_run_and_a_moving_average_only_where_there_are_so_many_trials(monkeypatch):
    drawn = []
    real = figure.drawing

    @contextmanager
    def kept(*words, **settings):
        with real(*words, **settings) as canvas:
            yield canvas
            drawn.extend(canvas.figure.axes)

    monkeypatch.setattr(figure, "drawing", kept)
    learning_curve(trial_rows(*[3.0] * 26), "curve")
    learning_curve(trial_rows(*[3.0] * 25), "too few")
    figure.trials_picture(trial_rows(1.0, 2.0), "run", 30.0)
    long, short, times, forces = drawn
    assert list(long.lines[0].get_xdata()) == [24, 25]
    assert len(short.lines) == 0
    assert (times.get_ylabel(), forces.get_ylabel()) == ("exploration time [s]", "peak force [N]")
    assert times.get_ylim() == (0.0, pytest.approx(2.2))
    assert forces.get_ylim()[1] > forces.lines[0].get_ydata()[0] == 30.0
    assert all(place == round(place) for place in forces.get_xticks())


ACTIONS = compass_actions(0.001)
STATES = ("north", "in the middle", "south", "west")


def test_mixed_policy_is_shown_state_by_state():
    q = QLearning(STATES, ACTIONS, QParameters(alpha=1.0, gamma=1.0, temperature=TemperatureSchedule(1.0, 1.0, 0.1)))
    policy = MixedPolicy(STATES, [ProgrammedPolicy(STATES, ACTIONS, {"south": "+y", "west": "+x"}), q])
    for index in range(8):
        policy.learn(Transition(0, index, -1.5 if index == 6 else -20.0, None))
    for _ in range(3):
        policy.learn(Transition(2, 2, -1.25, None))
    assert render_table(document_of(policy, created_with={}, perception={})) == "\n".join(
        [
            "4 states, 8 actions; q-learning, trained on 1 trial",
            "",
            "state          source      best action   value         visits",
            "north          learned     -y           -1.500              8",
            "in the middle  learned     -                 -  never visited",
            "south          programmed  +y           -1.250              3",
            "west           programmed  +x                -  never visited",
            "",
        ]
    )
