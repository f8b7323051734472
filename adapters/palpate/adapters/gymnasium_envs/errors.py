"""Errors of the environments: ours and Gymnasium's at the same time, so that either is caught by who expects it.

A vector environment makes a worker's error anew in the parent process from its text alone, so each can be made of that.
"""

from __future__ import annotations

import gymnasium.error

from palpate.core.errors import CommandError, ConfigurationError, LifecycleError


class ActionRefusedError(CommandError, gymnasium.error.InvalidAction):
    """An action that the environment does not have.

    Attributes:
        value: The action, as text.
    """

    def __init__(self, text: str, action: object = None) -> None:
        self.value = repr(action)
        Exception.__init__(self, text)


class NotRunningError(LifecycleError, gymnasium.error.ResetNeeded):
    """A step without an episode that runs."""

    def __init__(self, text: str) -> None:
        self.state, self.request = text, "step()"
        Exception.__init__(self, text)


def refuse_unknown(environment: str, unknown: dict[str, object], known: tuple[str, ...]) -> None:
    """Refuse keyword arguments that an environment does not have.

    Raises:
        ConfigurationError: Naming the first of them, and those that there are.
    """
    for name, value in unknown.items():
        raise ConfigurationError(name, value, f"no such argument of {environment}; there are {', '.join(known)}")
