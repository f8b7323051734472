"""Programmed knowledge: the action that a person wrote down for a state (paper, section 3.5)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from palpate.core.policy.actions import Action
from palpate.core.policy.assigned import AssignedPolicy, check_known
from palpate.core.policy.base import PROGRAMMED


class ProgrammedPolicy(AssignedPolicy):
    """Takes the programmed action; states without an entry are left to another policy.

    Args:
        states: Names of the states.
        actions: The action set.
        table: Name of the action for names of states.

    Raises:
        ConfigurationError: ``policy.programmed`` names a state or an action that there is not.
    """

    def __init__(self, states: Sequence[str], actions: Sequence[Action], table: Mapping[str, str]) -> None:
        for state, action in table.items():
            check_known("policy.programmed", state, action, states, actions)
        index = {action.name: number for number, action in enumerate(actions)}
        assigned = [index[table[state]] if state in table else None for state in states]
        super().__init__(states, actions, assigned, PROGRAMMED)
