"""Declare settings once, in a frozen dataclass, for TOML, flags, Python, JSON and messages.

::

    @dataclass(frozen=True)
    class TaskConfig(Settings):
        TABLE: ClassVar[str] = "task"

        step_mm: Annotated[float, Range(0.01, 5.0)] = 0.7
        # The help text follows as a docstring.

The annotation gives the type and range, the assignment gives the default, and the docstring is the help text. Every
field is checked whenever an instance is constructed. :meth:`Settings.check` checks conditions across fields.
"""

import operator
import types
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from functools import cache
from math import inf, isfinite
from typing import Annotated, Any, ClassVar, Self, Union, get_args, get_origin, get_type_hints

from palpate.core.errors import ConfigurationError, did_you_mean


@dataclass(frozen=True, slots=True)
class Range:
    """Restriction to a finite number between two bounds.

    Attributes:
        unit: Unit, if the setting's name does not give it or a message needs it.
        above: True if ``low`` itself is not accepted.
        below: True if ``high`` itself is not accepted.
        text: Description of the accepted values, if the bounds alone do not explain them.
    """

    low: float = -inf
    high: float = inf
    unit: str = ""
    above: bool = False
    below: bool = False
    text: str = ""

    def holds(self, value: Any) -> bool:
        """Return True if the value is between the bounds."""
        beyond = (self.above and value == self.low) or (self.below and value == self.high)
        return not beyond and bool(self.low <= value <= self.high)

    def words(self, base: Any) -> str:
        """Return the range in words, for a message."""
        number = "a whole number" if base is int else "a number"
        low, high = (str(end) if isinstance(end, int) else f"{end:g}" for end in (self.low, self.high))
        if self.text:
            return self.text
        if self.low == -inf:
            return "a finite number"
        begin = f"above {low}" if self.above else f"from {low}"
        if self.high == inf:
            return f"{number} {begin}" if self.above else f"{number} {begin} up"
        if self.above or self.below:
            return f"{number} {begin} and {'below' if self.below else 'at most'} {high}"
        return f"{number} {begin} to {high}"


class OneOf:
    """Restriction to one of several values."""

    def __init__(self, *values: str | int) -> None:
        self.values = values

    def holds(self, value: Any) -> bool:
        """Return True if the value is one of the accepted values."""
        return value in self.values

    def words(self, base: Any) -> str:
        """Return the list of values for a message."""
        return f"one of {', '.join(str(value) for value in self.values if value != '')}"


@dataclass(frozen=True, slots=True)
class Holds:
    """Condition on one value that is neither a range nor a list of values."""

    test: Callable[[Any], bool]
    text: str

    def holds(self, value: Any) -> bool:
        """Return True if the value meets the condition."""
        return self.test(value)

    def words(self, base: Any) -> str:
        """Return the accepted values in words."""
        return self.text


Mark = Range | OneOf | Holds


class Settings:
    """Base class for every table of settings; the constructor checks each field against its annotation.

    Attributes:
        TABLE: Dotted name of the table in TOML and on the command line; empty for the outermost one.

    Raises:
        ConfigurationError: A value has the wrong type or is outside its range, or two settings contradict each other.
    """

    __slots__ = ()
    TABLE: ClassVar[str] = ""

    def __post_init__(self) -> None:
        for name, kind in kinds_of(type(self)).items():
            value = getattr(self, name)
            fit = fitted(self.dotted(name), value, kind)
            if fit is not value:
                # An int given for a float, or a list given for a tuple, is stored in the declared form.
                object.__setattr__(self, name, fit)
        self.check()

    def check(self) -> None:
        """Reject settings that contradict each other.

        Raises:
            ConfigurationError: The message names one of these settings.
        """

    def require(self, name: str, holds: bool, accepted: str) -> None:
        """Reject a field's value unless a condition holds.

        Raises:
            ConfigurationError: The message gives the field, its value and the accepted values.
        """
        if not holds:
            raise ConfigurationError(self.dotted(name), getattr(self, name), accepted)

    @classmethod
    def read(cls, raw: object, where: str = "") -> Self:
        """Read a table from plain JSON. Only a field whose default is None may be missing.

        Args:
            where: Dotted name of the object; empty for a whole file.

        Raises:
            ConfigurationError: Keys are missing or unknown, or a value is rejected; the message says where.
        """
        kinds, prefix = kinds_of(cls), f"{where}." if where else ""
        given = fitted(where or cls.TABLE, raw, Mapping[str, Any])
        needed = [field.name for field in fields(cls) if field.default is not None]  # type: ignore[arg-type]
        require_keys(where or cls.TABLE, given, needed, [name for name in kinds if name not in needed])
        # The location in the file is known here, but not in the table itself.
        values = {key: fitted(f"{prefix}{key}", value, kinds[key]) for key, value in given.items()}
        try:
            return cls(**values)
        except ConfigurationError as error:
            field = error.field.removeprefix(f"{cls.TABLE}.")
            raise ConfigurationError(f"{prefix}{field}", error.value, error.accepted) from error

    @classmethod
    def dotted(cls, name: str) -> str:
        """Return a field's dotted name in TOML, flags and messages."""
        return f"{cls.TABLE}.{name}" if cls.TABLE else name


def _kinds_of(table: type) -> dict[str, Any]:
    hints = get_type_hints(table, include_extras=True)
    return {field.name: hints[field.name] for field in fields(table)}


kinds_of: Callable[[type], dict[str, Any]] = cache(_kinds_of)
"""Return each dataclass field's annotation, with metadata, in declaration order."""


def parts_of(kind: Any) -> tuple[Any, tuple[Mark, ...]]:
    """Split an annotation into its type and its metadata."""
    if get_origin(kind) is not Annotated:
        return kind, ()
    base, *marks = get_args(kind)
    return base, tuple(mark for mark in marks if isinstance(mark, Mark))


def optional_of(base: Any) -> Any:
    """Return an optional annotation's type without None, or None if it is not optional."""
    if get_origin(base) not in (Union, types.UnionType) or type(None) not in get_args(base):
        return None
    (inner,) = [kind for kind in get_args(base) if kind is not type(None)]
    return inner


def table_or(base: Any) -> type[Settings] | None:
    """Return the table type that an annotation accepts instead of a name, or None if there is none."""
    if get_origin(base) not in (Union, types.UnionType):
        return None
    return next((kind for kind in get_args(base) if isinstance(kind, type) and issubclass(kind, Settings)), None)


def require_keys(where: str, given: Mapping[str, Any], needed: Sequence[str], others: Sequence[str] = ()) -> None:
    """Reject an object with a missing or unknown key.

    Raises:
        ConfigurationError: The message lists the accepted keys.
    """
    missing = [key for key in needed if key not in given]
    unknown = [key for key in given if key not in (*needed, *others)]
    if missing or unknown:
        problem = f"{', '.join(map(_shown, missing))} is missing" if missing else f"{unknown[0]} is not one of them"
        keys = ", ".join(map(_shown, (*needed, *others)))
        raise ConfigurationError(where, sorted(given), f"a table with the keys {keys}; {problem}")


def accepted_by(kind: Any) -> str:
    """Return the accepted values in words, for a message."""
    base, marks = parts_of(kind)
    if marks:
        return marks[0].words(base)
    if (inner := optional_of(base)) is not None:
        return accepted_by(inner)
    origin, items = get_origin(base) or base, get_args(base)
    if origin is tuple:
        return f"a list, each {accepted_by(items[0])}" if items[-1] is ... else f"a list of {len(items)} numbers"
    names = {float: "a finite number", int: "a whole number", str: "a text", bool: "true or false"}
    return names.get(origin, "an object" if origin is Mapping else "a table")


@cache
def _analysed(kind: Any) -> tuple[Any, ...]:
    """Split an annotation for :func:`fitted`: type, metadata, optional type, table, origin and items."""
    base, marks = parts_of(kind)
    return base, marks, optional_of(base), table_or(base), get_origin(base) or base, get_args(base)


def fitted(name: str, value: Any, kind: Any) -> Any:
    """Convert a value to the form in which a setting of that kind stores it: 1.0 for 1, a tuple for a list.

    Raises:
        ConfigurationError: The value has the wrong type or is outside its range.
    """
    base, marks, inner, table, origin, items = _analysed(kind)
    if inner is not None:
        return None if value is None else fitted(name, value, inner)
    if table is not None:
        if not isinstance(value, Mapping):
            return value if isinstance(value, table) else fitted(name, value, str)
        required = [field.name for field in fields(table) if field.default is MISSING]
        require_keys(name, value, required, [key for key in kinds_of(table) if key not in required])
        return table(**value)
    if isinstance(origin, type) and issubclass(origin, Settings) and not isinstance(value, origin):
        return origin.read(value, name)
    if not _is_a(value, origin, items):
        raise ConfigurationError(name, value, accepted_by(kind))
    if origin is float:
        value = float(value)
    elif origin is tuple:
        each = items[:1] * len(value) if items[-1] is ... else items
        found = tuple(fitted(f"{name}[{n}]", item, each[n]) for n, item in enumerate(value))
        # Equality is not sufficient: 1 equals 1.0 but must be converted.
        value = value if isinstance(value, tuple) and all(map(operator.is_, value, found)) else found
    elif origin is dict:
        value = {str(key): fitted(f"{name}.{_shown(str(key))}", item, items[1]) for key, item in value.items()}
    for mark in marks:
        if not mark.holds(value):
            suggestion = did_you_mean(value, list(map(str, mark.values))) if isinstance(mark, OneOf) else ""
            raise ConfigurationError(name, value, mark.words(base) + suggestion)
    return value


def _shown(key: str) -> str:
    return key if key.isprintable() else repr(key)


def _is_a(value: Any, origin: Any, items: tuple[Any, ...]) -> bool:
    if origin is float:
        return isinstance(value, (int, float)) and not isinstance(value, bool) and _finite(value)
    if origin is int:
        return isinstance(value, int) and not isinstance(value, bool)
    if origin is Any:
        return True
    if origin is tuple:
        return isinstance(value, (tuple, list)) and (items[-1] is ... or len(items) == len(value))
    return isinstance(value, Mapping if origin is dict else origin)


def _finite(value: float) -> bool:
    try:
        return isfinite(value)
    except OverflowError:
        # An integer too large for a float.
        return False
