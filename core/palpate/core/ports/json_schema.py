"""JSON schema (draft 2020-12) of declared settings: types, ranges, units, defaults and help texts."""

import ast
import inspect
import textwrap
from collections.abc import Mapping
from dataclasses import MISSING, fields
from itertools import pairwise
from typing import Any, get_args, get_origin

from palpate.core.ports.settings import Settings, kinds_of, optional_of, parts_of, table_beside

_NAMES: dict[Any, str] = {float: "number", int: "integer", str: "string", bool: "boolean"}


def json_schema(kind: Any) -> dict[str, Any]:
    """The schema of one annotation, or of a whole table of settings."""
    base, marks = parts_of(kind)
    if (inner := optional_of(base)) is not None:
        return {"anyOf": [json_schema(inner), {"type": "null"}]}
    if (table := table_beside(base)) is not None:
        return {"anyOf": [json_schema(str), json_schema(table)]}
    origin, items = get_origin(base) or base, get_args(base)
    if isinstance(origin, type) and issubclass(origin, Settings):
        schema = _table(origin)
    elif origin is tuple and items[-1] is ...:
        schema = {"type": "array", "items": json_schema(items[0])}
    elif origin is tuple:
        schema = {"type": "array", "prefixItems": [json_schema(item) for item in items], "minItems": len(items)}
    else:
        schema = {"type": _NAMES.get(origin, "object")}
        if origin is dict:
            schema["additionalProperties"] = json_schema(items[1])
    for mark in marks:
        schema |= mark.schema()
    return schema


def _table(table: type[Settings]) -> dict[str, Any]:
    texts, properties = help_texts(table), {}
    for field in fields(table):  # type: ignore[arg-type]  # every table is a dataclass
        schema = json_schema(kinds_of(table)[field.name])
        if field.name in texts:
            schema["description"] = texts[field.name]
        default = field.default if field.default_factory is MISSING else field.default_factory()
        if default is not MISSING and not isinstance(default, Settings):
            schema["default"] = list(default) if isinstance(default, tuple) else default
        properties[field.name] = schema
    required = [f.name for f in fields(table) if f.default is MISSING and f.default_factory is MISSING]  # type: ignore[arg-type]
    about = {"description": inspect.getdoc(table), "type": "object", "additionalProperties": False}
    return about | {"properties": properties} | ({"required": required} if required else {})


def help_texts(table: type) -> Mapping[str, str]:
    """The help text of each field: the docstring that follows its declaration, on one line."""
    found: dict[str, str] = {}
    for owner in reversed([one for one in table.__mro__ if issubclass(one, Settings) and one is not Settings]):
        (body,) = ast.parse(textwrap.dedent(inspect.getsource(owner))).body
        lines = body.body if isinstance(body, ast.ClassDef) else []
        for field, text in pairwise(lines):
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(text, ast.Expr):
                found[field.target.id] = " ".join(str(ast.literal_eval(text.value)).split())
    return found
