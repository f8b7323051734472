"""Kinds of stages by which perception files name them, those of other rooms among them."""

import dataclasses
from typing import Any, Final

from palpate.core.errors import ConfigurationError

STAGES: Final[dict[str, type[Any]]] = {}
"""Classes by the kind that a file names."""


def register_stage(kind: str, stage: type[Any]) -> None:
    """Let a further kind of stage be written and read.

    Args:
        stage: A dataclass whose constructor takes plain JSON values (or other stages) and checks them.

    Raises:
        ConfigurationError: The name belongs to another class, or it is not a dataclass.
    """
    if not dataclasses.is_dataclass(stage):
        raise ConfigurationError("perception.stage", stage, "a dataclass")
    if STAGES.setdefault(kind, stage) is not stage:
        raise ConfigurationError("perception.stage.kind", kind, "a name that is not taken")
