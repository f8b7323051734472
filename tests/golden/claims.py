"""A policy that lies: it states that the peg is in before it has looked for the hole."""

from palpate.core.policy import DONE, Action, Decision, FixedPolicy


class Claims(FixedPolicy):
    """Steps once, then states that it is done."""

    def choose(self, observation):
        step = Action("east", (0.5e-3, 0.0))
        return Decision(DONE if observation.action_number else step, None, "claims")
