"""Settings by their dotted names, and tables of them as a study file writes them."""

import dataclasses
import os
from collections.abc import Mapping
from typing import Any, Final

from palpate.adapters.config import INSERTION, JOB, LEARNERS, RunConfig, compose, field_value, learner_in, read_job
from palpate.core.errors import ConfigurationError
from palpate.core.ports import fitted

_DEFAULTS: Final = RunConfig()
FILES: Final = ("perception.memory", "learning.examples")
"""Settings that may name files."""


def leaves(table: Mapping[str, Any], where: str) -> dict[str, Any]:
    """The settings in a table by their dotted names, whether written ``"task.step_mm"`` or as tables in tables."""
    found: dict[str, Any] = {}
    for name, value in _walk(table, _DEFAULTS, ""):
        if name in found:
            raise ConfigurationError(f"{where}.{name}", value, "each setting once")
        if name == "seed":
            raise ConfigurationError(f"{where}.{name}", value, "seeds in the table [study]: seeds = [0, 1, 2]")
        found[name] = value
    return found


def _walk(table: Mapping[str, Any], base: Any, where: str) -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []
    for key, value in table.items():
        head, _, rest = key.partition(".")
        held = {f.name: getattr(base, f.name) for f in dataclasses.fields(base)}.get(head)
        inner = {rest: value} if rest else value
        if dataclasses.is_dataclass(held) and isinstance(inner, Mapping):
            found += _walk(inner, held, f"{where}{head}.")
        else:
            found.append((f"{where}{key}", value))
    return found


def plain_value(name: str, value: Any) -> Any:
    """A setting's value in the one form in which it is written and compared: 1 is 1.0 where a float is meant."""
    return plain(field_value(_DEFAULTS, name, value))


def plain(value: Any) -> Any:
    """As JSON and TOML have it: lists for tuples."""
    if isinstance(value, (tuple, list)):
        return [plain(item) for item in value]
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    return value


def configured(settings: Mapping[str, Any], folder: str, job: str = "") -> RunConfig:
    """The configuration of its scenario with these settings over it; trials are not recorded unless one sets it.

    Args:
        folder: What names of files are relative to; workers may work in another folder.
        job: A job file; empty for the paper's job.
    """
    settings = {"recording.enabled": False, **settings}
    for field in FILES:
        if names_file(field, settings.get(field)):
            settings[field] = os.path.join(folder, settings[field])
    presets = settings.get("scenario", JOB if job else _DEFAULTS.scenario), settings.get("learner", _DEFAULTS.learner)
    table: dict[str, Any] = {}
    for dotted, value in settings.items():
        *path, last = dotted.split(".")
        inner = table
        for part in path:
            inner = inner.setdefault(part, {})
        inner[last] = value
    task = fitted("task.name", settings.get("task.name", INSERTION), str)
    return compose(*presets, table, task=task, job=read_job(job) if job else None)


def with_learner(settings: Mapping[str, Any], policy: str, folder: str) -> dict[str, Any]:
    """Settings with the learner that a policy is or was learned with, where it is one or a file.

    Args:
        policy: A learner's name, which is what learns; or a policy file, whose learner is meant unless one is set.
    """
    if policy in LEARNERS:
        return {**settings, "learner": policy}
    learned = learner_in(os.path.join(folder, policy))
    return {"learner": learned, **settings} if learned else dict(settings)


def names_file(field: str, value: Any) -> bool:
    """Whether the value of one of ``FILES`` names a file."""
    return isinstance(value, str) and (value.endswith(".json") if field == "perception.memory" else bool(value))


def setting(config: RunConfig | None, name: str) -> Any:
    """The value of a setting by its dotted name."""
    value: Any = config
    for part in name.split("."):
        value = getattr(value, part)
    return plain(value)
