"""Knowledge from examples: state-action pairs stored by other runs (paper, section 3.5)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from palpate.core.policy.base import EXAMPLES, Action
from palpate.core.policy.programmed import AssignedPolicy, check_known

_FIELD = "policy.examples"


class ExamplesPolicy(AssignedPolicy):
    """Policy that takes the most frequent action in the examples for a state; in a tie, the first in the set.

    The policy does not handle states without an example.

    Raises:
        ConfigurationError: ``policy.examples`` names an unknown state or action.
    """

    def __init__(self, states: Sequence[str], actions: Sequence[Action], examples: Iterable[tuple[str, str]]) -> None:
        row = {state: number for number, state in enumerate(states)}
        column = {action.name: number for number, action in enumerate(actions)}
        counts = [[0] * len(actions) for _ in states]
        for state, action in examples:
            check_known(_FIELD, state, action, states, actions)
            counts[row[state]][column[action]] += 1
        assigned = [line.index(max(line)) if any(line) else None for line in counts]
        super().__init__(states, actions, assigned, EXAMPLES)
