"""Configurations to and from TOML. Unknown and ill-typed fields are refused by name."""

from __future__ import annotations

import dataclasses
import difflib
import json
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from palpate.core.errors import ConfigurationError

T = TypeVar("T")


def read_toml(path: Path) -> dict[str, Any]:
    """The table in a TOML file.

    Raises:
        ConfigurationError: No such file, or it is not TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigurationError("config", str(path), f"a readable file ({error.strerror})") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigurationError("config", str(path), f"a TOML file ({error})") from error


def overlay(base: T, table: Mapping[str, Any], where: str = "") -> T:
    """A copy of a configuration with the fields of a TOML table put over it.

    Args:
        base: A frozen dataclass.
        table: Nested as the dataclass is.
        where: Dotted name of ``base`` itself, for messages.

    Raises:
        ConfigurationError: An unknown field, or a value of another type.
    """
    hints = get_type_hints(type(base))
    changes: dict[str, Any] = {}
    for key, value in table.items():
        name = f"{where}{key}"
        if key not in hints:
            raise _unknown(name, value, key, hints, where)
        current = getattr(base, key)
        if dataclasses.is_dataclass(current):
            if not isinstance(value, Mapping):
                raise ConfigurationError(name, value, "a table")
            changes[key] = overlay(current, value, f"{name}.")
        else:
            changes[key] = _converted(name, value, hints[key])
    return dataclasses.replace(base, **changes)  # type: ignore[type-var]


def field_value(base: Any, name: str, value: Any) -> Any:
    """A TOML value as the field of a dotted name would hold it; whether it fits the other fields is not looked at.

    Args:
        base: A dataclass, with the field in it or in one that it holds.
        name: Dotted name of the field.
        value: As TOML gave it.

    Raises:
        ConfigurationError: There is no such field, it is a table of fields, or the value is of another type.
    """
    where, (*path, last) = "", name.split(".")
    for key in path:
        if key not in get_type_hints(type(base)):
            raise _unknown(name, value, key, get_type_hints(type(base)), where)
        base, where = getattr(base, key), f"{where}{key}."
        if not dataclasses.is_dataclass(base):
            raise ConfigurationError(name, value, f"no such field; {where[:-1]} has none of its own")
    hints = get_type_hints(type(base))
    if last not in hints:
        raise _unknown(name, value, last, hints, where)
    if dataclasses.is_dataclass(getattr(base, last)):
        raise ConfigurationError(name, value, f"one of its fields: {', '.join(get_type_hints(hints[last]))}")
    return _converted(name, value, hints[last])


def to_toml(config: Any, prefix: str = "") -> str:
    """A configuration as TOML text; ``overlay`` of it on the default gives the configuration back."""
    lines, tables = [], []
    for f in dataclasses.fields(config):
        value = getattr(config, f.name)
        if dataclasses.is_dataclass(value):
            name = f"{prefix}{f.name}"
            tables.append(f"\n[{name}]\n{to_toml(value, name + '.')}")
        else:
            lines.append(f"{f.name} = {literal(value)}\n")
    return "".join(lines) + "".join(tables)


def _unknown(name: str, value: Any, key: str, known: Mapping[str, Any], where: str) -> ConfigurationError:
    near = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
    hint = f"; did you mean {where}{near[0]}?" if near else ""
    return ConfigurationError(name, value, f"no such field{hint} (known here: {', '.join(known)})")


def _converted(name: str, value: Any, kind: Any) -> Any:
    if kind is float and isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value)
    if kind is int and isinstance(value, int) and not isinstance(value, bool):
        return value
    if kind in (str, bool) and isinstance(value, kind):
        return value
    if get_origin(kind) is tuple and isinstance(value, list):
        items = [i for i in get_args(kind) if i is not Ellipsis]
        if len(items) == 1 or len(items) == len(value):
            kinds = items if len(items) > 1 else items * len(value)
            return tuple(_converted(f"{name}[{i}]", v, k) for i, (v, k) in enumerate(zip(value, kinds, strict=True)))
    if get_origin(kind) is dict and isinstance(value, Mapping):
        return {str(k): _converted(f"{name}.{k}", v, get_args(kind)[1]) for k, v in value.items()}
    raise ConfigurationError(name, value, f"a value of type {getattr(kind, '__name__', kind)}")


def literal(value: Any) -> str:
    """A value as TOML writes it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        # TOML's basic strings are JSON's, as long as nothing is written as a surrogate pair.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(literal(v) for v in value) + "]"
    return "{ " + ", ".join(f"{literal(k)} = {literal(v)}" for k, v in value.items()) + " }"
