"""Convert configurations to and from TOML. Errors name unknown fields and fields with the wrong type."""

import dataclasses
import difflib
import json
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, TypeVar

from palpate.adapters.files import read_text
from palpate.core.errors import ConfigurationError
from palpate.core.ports import Settings, fitted, kinds_of, table_or

T = TypeVar("T", bound=Settings)
RUN_FORMAT: Final = "palpate.run/2"
"""Run folder format."""


def read_toml(path: str | Path, field: str = "config") -> dict[str, Any]:
    """Return the table in a TOML file. Paths to the arm's URDF and calibration are relative to the file's folder.

    Raises:
        ConfigurationError: The file does not exist or is not TOML.
    """
    try:
        table = tomllib.loads(read_text(path, field))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise ConfigurationError(field, str(path), f"no valid TOML: {error}") from error
    if isinstance(arm := table.get("arm"), dict):
        for key in ("urdf", "calibration"):
            if isinstance(named := arm.get(key), str) and named and "://" not in named:
                arm[key] = str(Path(path).resolve().parent / named)
    return table


def run_facts(table: dict[str, Any], path: str | Path) -> dict[str, Any]:
    """Remove the ``[run]`` table from a run's settings and return it. It is empty for hand-written settings.

    Raises:
        ConfigurationError: The run folder has a different format.
    """
    if "run" not in table:
        return {}
    facts = table.pop("run")
    found = facts.get("format") if isinstance(facts, Mapping) else None
    if found != RUN_FORMAT:
        raise ConfigurationError("run.format", found, f"{RUN_FORMAT!r}, which this version reads, in {path}")
    return dict(facts)


def overlay(base: T, table: Mapping[str, Any]) -> T:
    """Return a copy of a configuration with the fields in a TOML table replaced.

    Raises:
        ConfigurationError: A field is unknown, or its value is rejected.
    """
    changes: dict[str, Any] = {}
    for key, value in table.items():
        name = base.dotted(key)
        if key not in kinds_of(type(base)):
            raise _unknown(type(base), name, value, key)
        current = getattr(base, key)
        if isinstance(current, Settings) and table_or(kinds_of(type(base))[key]) is None:
            if not isinstance(value, Mapping):
                raise ConfigurationError(name, value, "a table")
            value = overlay(current, value)
        changes[key] = value
    # mypy does not see that every subclass is a dataclass.
    return dataclasses.replace(base, **changes)  # type: ignore[type-var]


def merged(*tables: Mapping[str, Any]) -> dict[str, Any]:
    """Merge nested tables; later tables override earlier ones."""
    result: dict[str, Any] = {}
    for table in tables:
        for key, value in table.items():
            before = result.get(key)
            both = isinstance(before, Mapping) and isinstance(value, Mapping)
            result[key] = merged(before, value) if both else value  # type: ignore[arg-type]
    return result


def nested(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Convert settings with dotted names to nested tables."""
    tables: dict[str, Any] = {}
    for name, value in settings.items():
        *path, last = name.split(".")
        table = tables
        for part in path:
            table = table.setdefault(part, {})
        table[last] = value
    return tables


def field_value(base: Settings, name: str, value: Any) -> Any:
    """Convert a TOML value to the type of a field in ``base``, given by its dotted name; other fields are not checked.

    Raises:
        ConfigurationError: The field is unknown or is a table of fields, or the value is rejected.
    """
    *path, last = name.split(".")
    for key in path:
        if key not in kinds_of(type(base)):
            raise _unknown(type(base), name, value, key)
        inner = getattr(base, key)
        if not isinstance(inner, Settings):
            raise ConfigurationError(name, value, f"no such field; {base.dotted(key)} has none of its own")
        base = inner
    kinds = kinds_of(type(base))
    if last not in kinds:
        raise _unknown(type(base), name, value, last)
    if isinstance(held := getattr(base, last), Settings):
        raise ConfigurationError(name, value, f"one of its fields: {', '.join(kinds_of(type(held)))}")
    return fitted(name, value, kinds[last])


def to_toml(config: Any, prefix: str = "") -> str:
    """Return a configuration as TOML text; overlaying it on the defaults restores the configuration."""
    lines, tables = [], []
    for f in dataclasses.fields(config):
        value = getattr(config, f.name)
        if dataclasses.is_dataclass(value):
            name = f"{prefix}{f.name}"
            tables.append(f"\n[{name}]\n{to_toml(value, name + '.')}")
        else:
            lines.append(f"{f.name} = {literal(value)}\n")
    return "".join(lines) + "".join(tables)


def _unknown(table: type[Settings], name: str, value: Any, key: str) -> ConfigurationError:
    known = kinds_of(table)
    near = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
    hint = f"; did you mean {table.dotted(near[0])}?" if near else ""
    return ConfigurationError(name, value, f"no such field{hint} (known here: {', '.join(known)})")


def literal(value: Any) -> str:
    """Return a value as a TOML literal."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        # TOML basic strings are the same as JSON strings, except for escaped surrogate pairs.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(literal(v) for v in value) + "]"
    if dataclasses.is_dataclass(value):
        value = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
    return "{ " + ", ".join(f"{literal(k)} = {literal(v)}" for k, v in value.items()) + " }"
