"""Kinds of settings that several tables share, each declared once, and the kinds of stages that a file may name."""

from collections.abc import Sequence
from typing import Annotated, Any, Final, TypeAlias

from palpate.core.errors import ConfigurationError
from palpate.core.ports.settings import Holds, OneOf, Range, Settings

CHANNELS: Final = ("x", "y", "z", "fx", "fy", "fz", "tx", "ty", "tz")
"""Names of the nine components of the measurement, in the order of the vector."""

LearningRate: TypeAlias = Annotated[float, Range(0.0, 1.0, above=True)]
HalvingVisits: TypeAlias = Annotated[float, Range(0.0, 1e9)]
"""Visits that halve a learning rate, or a weight; 0 is for never."""
Discount: TypeAlias = Annotated[float, Range(0.0, 1.0)]
Temperature: TypeAlias = Annotated[float, Range(0.0, 1e6)]
TemperatureDecay: TypeAlias = Annotated[float, Range(0.0, 1.0, above=True)]
Matrix: TypeAlias = tuple[tuple[float, ...], ...]


def _distinct(names: Sequence[str]) -> bool:
    return bool(names) and all(names) and len(set(names)) == len(names)


Names: TypeAlias = Annotated[tuple[str, ...], Holds(_distinct, "a list of names, each only once")]
Channels: TypeAlias = Annotated[
    tuple[Annotated[str, OneOf(*CHANNELS)], ...],
    Holds(_distinct, f"names out of {', '.join(CHANNELS)}, each only once"),
]

STAGES: Final[dict[str, type[Settings]]] = {}
"""Stages of perception by the kind that a file names."""


def register_stage(kind: str, stage: type[Any]) -> None:
    """Let a further kind of stage be written and read.

    Args:
        stage: A dataclass derived from :class:`Settings`; its fields are plain JSON values, or other stages.

    Raises:
        ConfigurationError: The name belongs to another class, or it does not derive from :class:`Settings`.
    """
    if not issubclass(stage, Settings):
        raise ConfigurationError("perception.stage", stage, "a dataclass that derives from Settings")
    if STAGES.setdefault(kind, stage) is not stage:
        raise ConfigurationError("perception.stage.kind", kind, "a name that is not taken")


def require_names(field: str, names: Sequence[str], *, printable: bool = True) -> None:
    """Refuse a list of names that is empty, has one twice, or one that cannot be shown.

    Raises:
        ConfigurationError: Naming the first of them that is wrong.
    """
    if not names:
        raise ConfigurationError(field, names, "a list of at least one")
    for number, name in enumerate(names):
        if not name or (printable and not name.isprintable()) or name in names[:number]:
            accepted = f"a {'printable ' if printable else ''}name, and none twice"
            raise ConfigurationError(f"{field}[{number}]", name, accepted)


def require_floor(field: str, floor: float, start: float, name: str) -> None:
    """Refuse a floor above what falls to it.

    Raises:
        ConfigurationError: It is above.
    """
    if floor > start:
        raise ConfigurationError(field, floor, f"a number from 0 to {name}, {start:g}")
