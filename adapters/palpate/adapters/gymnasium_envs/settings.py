"""From the keyword arguments of an environment to the configuration of a run."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

from palpate.adapters.config import RunConfig, scenario
from palpate.adapters.toml_config import overlay, read_toml
from palpate.core.errors import ConfigurationError

Settings: TypeAlias = Mapping[str, Any] | str | os.PathLike[str] | None
"""A nested table of settings, a TOML file with one (a ``run.toml`` too), or nothing."""


def run_config(scenario_name: str, arm: str, settings: Settings) -> RunConfig:
    """The configuration of the trials.

    Args:
        scenario_name: Preset to start from; empty takes the one of the settings, or ``paper``.
        arm: Name of the arm; empty takes that of the settings.
        settings: Put over the preset.

    Raises:
        ConfigurationError: A setting is unknown or refused, or the file cannot be read.
    """
    table = _table(settings)
    # How the run of a run.toml came about is no setting.
    table.pop("run", None)
    name = scenario_name or table.get("scenario", "paper")
    config = overlay(scenario(name), {**table, "scenario": name})
    return replace(config, arm=arm) if arm else config


def _table(settings: Settings) -> dict[str, Any]:
    if settings is None:
        return {}
    if isinstance(settings, Mapping):
        return dict(settings)
    if isinstance(settings, (str, os.PathLike)):
        return read_toml(Path(settings))
    raise ConfigurationError("config", settings, "a table of settings, the name of a TOML file, or None")
