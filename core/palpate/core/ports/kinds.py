"""Setting types shared by several tables, and the perception stage kinds that a file may name."""

from collections.abc import Sequence
from typing import Annotated, Any, Final, TypeAlias

from palpate.core.errors import ConfigurationError
from palpate.core.ports.settings import Holds, OneOf, Range, Settings

CHANNELS: Final = ("x", "y", "z", "fx", "fy", "fz", "tx", "ty", "tz")
"""Names of the nine measurement components, in vector order."""

LearningRate: TypeAlias = Annotated[float, Range(0.0, 1.0, above=True)]
HalvingVisits: TypeAlias = Annotated[float, Range(0.0, 1e9)]
"""Number of visits after which a learning rate or a weight is halved; 0 disables it."""
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
"""Perception stages, keyed by the name of their kind used in files."""


def register_stage(kind: str, stage: type[Any]) -> None:
    """Register another kind of stage for reading and writing.

    Args:
        stage: A dataclass derived from :class:`Settings`; its fields are plain JSON values or other stages.

    Raises:
        ConfigurationError: Another class uses the name, or the class does not derive from :class:`Settings`.
    """
    if not issubclass(stage, Settings):
        raise ConfigurationError("perception.stage", stage, "a dataclass that derives from Settings")
    if STAGES.setdefault(kind, stage) is not stage:
        raise ConfigurationError("perception.stage.kind", kind, "a name that is not taken")


def require_names(field: str, names: Sequence[str], *, printable: bool = True) -> None:
    """Reject an empty list of names, duplicates, and names that cannot be printed.

    Raises:
        ConfigurationError: The message contains the first invalid name.
    """
    if not names:
        raise ConfigurationError(field, names, "a list of at least one")
    for number, name in enumerate(names):
        if not name or (printable and not name.isprintable()) or name in names[:number]:
            accepted = f"a {'printable ' if printable else ''}name, and none twice"
            raise ConfigurationError(f"{field}[{number}]", name, accepted)


def require_floor(field: str, floor: float, start: float, name: str) -> None:
    """Reject a floor above the initial value, which decays to the floor.

    Raises:
        ConfigurationError: The floor is above the initial value.
    """
    if floor > start:
        raise ConfigurationError(field, floor, f"a number from 0 to {name}, {start:g}")
