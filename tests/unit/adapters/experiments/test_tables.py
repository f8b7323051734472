from palpate.adapters.experiments.tables import render_table
from palpate.core.policy import document_of
from palpate.core.policy.base import Transition, compass_actions
from palpate.core.policy.exploration import TemperatureSchedule
from palpate.core.policy.programmed import MixedPolicy, ProgrammedPolicy
from palpate.core.policy.tabular import QLearning, QParameters

ACTIONS = compass_actions(0.001)
STATES = ("north", "in the middle", "south", "west")


def test_a_mixed_policy_is_shown_state_by_state():
    q = QLearning(STATES, ACTIONS, QParameters(alpha=1.0, gamma=1.0, temperature=TemperatureSchedule(1.0, 1.0, 0.1)))
    policy = MixedPolicy(STATES, [ProgrammedPolicy(STATES, ACTIONS, {"south": "+y", "west": "+x"}), q])
    for index in range(8):
        policy.learn(Transition(0, index, -1.5 if index == 6 else -20.0, None))
    for _ in range(3):
        policy.learn(Transition(2, 2, -1.25, None))
    assert render_table(document_of(policy, created_with={}, perception={})) == "\n".join(
        [
            "4 states, 8 actions; q-learning, 1 trials learned",
            "",
            "state          source      best action   value         visits",
            "north          learned     -y           -1.500              8",
            "in the middle  learned     -                 -  never visited",
            "south          programmed  +y           -1.250              3",
            "west           programmed  +x                -  never visited",
            "",
        ]
    )
