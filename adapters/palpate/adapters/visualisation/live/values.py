"""What the actions of a state are worth to a policy."""

from collections.abc import Mapping
from typing import Any

from palpate.core.policy import PolicyDocument


def values_in(policy: PolicyDocument | None, state: Mapping[str, Any] | None) -> dict[str, dict[str, float]]:
    """Return the value of each action in each state; empty for a policy without such a table.

    Args:
        state: Of its learner; None takes the one in the policy's document.
    """
    if policy is None:
        return {}
    if state is None:
        state = {} if policy.learner is None else policy.learner.state
    actions = [action.name for action in policy.actions]
    return {
        name: dict(zip(actions, map(float, row), strict=True))
        for name, row in zip(policy.states, state.get("q", ()), strict=False)
        if len(row) == len(actions)
    }
