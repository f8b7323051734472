"""The table ``[run]`` of a ``run.toml``: how the run came about, and the format of its folder."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from palpate.core.errors import ConfigurationError

RUN_FORMAT: Final = "palpate.run/1"
"""Format of a run folder."""


def run_facts(table: dict[str, Any], path: str | Path) -> dict[str, Any]:
    """Take the table ``[run]`` out of a run's settings; empty for settings without one, which a person wrote.

    Raises:
        ConfigurationError: The run folder has another format.
    """
    if "run" not in table:
        return {}
    facts = table.pop("run")
    found = facts.get("format") if isinstance(facts, Mapping) else None
    if found != RUN_FORMAT:
        raise ConfigurationError("run.format", found, f"{RUN_FORMAT!r}, which this palpate reads, in {path}")
    return dict(facts)
