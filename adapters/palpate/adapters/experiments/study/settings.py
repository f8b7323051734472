"""Settings by their dotted names, and tables of them as a study file writes them."""

import os
from collections.abc import Mapping
from typing import Any, Final

from palpate.adapters.config import LEARNERS, RunConfig, configured, field_value
from palpate.core.errors import ConfigurationError
from palpate.core.ports import Settings

_DEFAULTS: Final = RunConfig()
_FILES: Final = ("perception.memory", "learning.examples")
"""Settings that may name files."""


def settings_in(table: Mapping[str, Any], base: Settings = _DEFAULTS) -> dict[str, Any]:
    """Return the settings of a table by dotted name, written ``"task.step_mm"`` or as tables in tables."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        head, _, rest = key.partition(".")
        inner, below = {rest: value} if rest else value, getattr(base, head, None)
        if isinstance(below, Settings) and isinstance(inner, Mapping):
            found |= {f"{head}.{name}": each for name, each in settings_in(inner, below).items()}
        else:
            found[key] = value
    if base is _DEFAULTS and "seed" in found:
        raise ConfigurationError("seed", found["seed"], "seeds in the table [study]: seeds = [0, 1, 2]")
    return found


def plain_value(name: str, value: Any) -> Any:
    """Return a setting's value in its one form: 1 is 1.0 where a float is meant."""
    return _plain(field_value(_DEFAULTS, name, value))


def _plain(value: Any) -> Any:
    if isinstance(value, (tuple, list)):
        return [_plain(item) for item in value]
    return value


def condition_config(settings: Mapping[str, Any], policy: str, job: str = "") -> RunConfig:
    """Return the configuration of these settings; trials are not recorded unless one sets it.

    Args:
        settings: By dotted name. Files are named from the working folder.
        policy: A learner, which is what learns; or a policy file, whose learner is meant unless one is set.
        job: A job file; empty for the paper's job.

    Raises:
        ConfigurationError: The settings do not go together.
    """
    settings = {"recording.enabled": False, **settings}
    memory, examples = (settings.get(name) for name in _FILES)
    if isinstance(memory, str) and memory.endswith(".json"):
        settings[_FILES[0]] = os.path.abspath(memory)
    if isinstance(examples, str) and examples:
        settings[_FILES[1]] = os.path.abspath(examples)
    table: dict[str, Any] = {}
    for dotted, value in settings.items():
        *path, last = dotted.split(".")
        inner = table
        for part in path:
            inner = inner.setdefault(part, {})
        inner[last] = value
    learner = policy if policy in LEARNERS else ""
    return configured(job or None, learner=learner, policy=policy, settings=table)


def setting_of(config: RunConfig, name: str) -> Any:
    """Return the value of a setting by its dotted name."""
    value: Any = config
    for part in name.split("."):
        value = getattr(value, part)
    return _plain(value)
