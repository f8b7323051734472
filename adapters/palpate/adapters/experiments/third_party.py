"""Third-party policies, which are found by name, created for a task, and wrapped."""

import hashlib
import importlib.metadata
import inspect
import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from typing import Any, Final

from palpate.adapters.config import RunConfig, entries, from_here, imported
from palpate.adapters.experiments.build import task_actions, task_bounds
from palpate.core.errors import ConfigurationError, describe
from palpate.core.perception import Perception
from palpate.core.policy import PolicyContext, ThirdPartyEntry, ThirdPartyPolicy

GROUP: Final = "palpate.policies"
"""Group for entry points that name policies; each is a class or function that creates a policy."""
_PLACE: Final = re.compile(r"[^\W\d][\w.]*:[^\W\d]\w*")


def third_party_code(name: str) -> str:
    """Return the code for the named policy, ``package.module:Name``, or an empty string for other names."""
    if _PLACE.fullmatch(name):
        return name
    entry = None if "/" in name or name.endswith(".json") else entries(GROUP).get(name)
    return "" if entry is None else entry.value


def third_party_entry(code: str) -> ThirdPartyEntry:
    """Return a policy file entry for the installed code, without learned state.

    Raises:
        ConfigurationError: The code cannot be loaded.
    """
    _maker(code)
    module = code.partition(":")[0]
    names = _distributions(tuple(sys.path)).get(module.partition(".")[0], [])
    owner = next((entry.dist for entry in entries(GROUP).values() if entry.value == code), None)
    distribution = owner.name if owner is not None else next(iter(names), "")
    version = importlib.metadata.version(distribution) if distribution else ""
    return ThirdPartyEntry(code, distribution, version, _source_sha256(module), 0)


def third_party_policy(
    entry: ThirdPartyEntry, config: RunConfig, perception: Perception, *, frozen: bool
) -> ThirdPartyPolicy:
    """Return a policy created by the code, with its learned state restored.

    Raises:
        ConfigurationError: The code cannot be loaded, or creates no policy.
        PolicyError: The policy rejects its state.
    """
    maker = _maker(entry.code)
    context = PolicyContext(tuple(perception.states), task_actions(config), task_bounds(config))
    try:
        # Not every class has a task parameter.
        with from_here():
            made = maker(context) if inspect.signature(maker).parameters else maker()
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise ConfigurationError("policy", entry.code, f"no policy can be made: {describe(error)}") from error
    now = replace(third_party_entry(entry.code), trials_learned=entry.trials_learned, state=entry.state)
    return ThirdPartyPolicy(made, now, context, frozen=frozen)


def _maker(code: str) -> Callable[..., Any]:
    with from_here():
        maker: Any = imported("policy", code, "package.module:Name")
    if not callable(maker):
        raise ConfigurationError("policy", code, "a class or a function that makes a policy")
    made: Callable[..., Any] = maker
    return made


@cache
def _distributions(path: tuple[str, ...]) -> Mapping[str, list[str]]:
    """Return the distributions for each package on the path. They are cached because the search takes half a second."""
    return importlib.metadata.packages_distributions()


def _source_sha256(module: str) -> str:
    try:
        return hashlib.sha256(inspect.getsource(sys.modules[module]).encode()).hexdigest()
    except (OSError, TypeError):
        return ""
