"""JSON files of declared tables: read strictly, and refused in one line that names the place."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from palpate.core.errors import ConfigurationError
from palpate.core.ports.files import whole_text

T = TypeVar("T")


def load_json(path: str | Path, whole: str, read: Callable[[str], T]) -> T:
    """What is read from a file.

    Raises:
        ConfigurationError: The file cannot be read, or ``read`` refuses it.
    """
    try:
        return read(whole_text(path).read())
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(whole, str(path), f"a readable file in UTF-8 ({error})") from error
    except ConfigurationError as error:
        raise ConfigurationError(f"{path}: {error.field}", error.value, error.accepted) from error


def json_of_file(path: str | Path) -> Any:
    """What is in a JSON file, of any form.

    Raises:
        OSError: It cannot be read.
        ValueError: It is no JSON in UTF-8.
    """
    text = whole_text(path).read()
    try:
        return json.loads(text)
    except RecursionError as error:
        raise ValueError("nested too deeply") from error


def parse_json(text: str, whole: str, schema: str) -> dict[str, Any]:
    """The object in a text of strict JSON: no NaN, no infinity, no key twice.

    Its key ``schema`` must hold ``schema``. It is checked first: a file of another schema may have other keys.

    Raises:
        ConfigurationError: It is no such object.
    """

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) != len(pairs):
            keys = [key for key, _ in pairs]
            repeated = next(key for key in keys if keys.count(key) > 1)
            raise ConfigurationError(whole, repeated, "each key once in its object")
        return found

    def refuse(name: str) -> NoReturn:
        raise ConfigurationError(whole, name, "finite numbers only")

    try:
        raw = json.loads(text, object_pairs_hook=once, parse_constant=refuse)
    except ConfigurationError:
        raise
    except (ValueError, RecursionError) as error:
        raise ConfigurationError(whole, text, f"JSON ({error})") from error
    if not isinstance(raw, dict):
        raise ConfigurationError(whole, raw, "an object")
    if (found := raw.get("schema")) != schema:
        ours = isinstance(found, str) and found.split("/")[0] == schema.split("/")[0]
        raise ConfigurationError("schema", found, repr(schema) if ours else f"{schema!r}: this is no {whole}")
    return raw
