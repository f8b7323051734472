"""Settings of a run as flags, such as ``--task.step-mm 0.5``: which there are, and the table that they make."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any, Final, get_args, get_origin

from palpate.adapters.config import Described, RunConfig, described
from palpate.core.errors import UsageError
from palpate.core.ports import optional_of, parts_of


def _flags() -> dict[str, tuple[Described, bool]]:
    """Setting and value of each switch by its flag; of other settings the value says nothing."""
    found: dict[str, tuple[Described, bool]] = {}
    for setting in described(RunConfig):
        table, _, last = setting.name.replace("_", "-").rpartition(".")
        # Presets, arm and seed are options of the commands.
        if table:
            found[f"--{table}.{last}"] = setting, True
            if isinstance(setting.default, bool):
                found[f"--{table}.no-{last}"] = setting, False
    return found


SETTING_FLAGS: Final = _flags()
_ANY_CASE: Final = {flag.lower(): flag for flag in SETTING_FLAGS}


def settings_in(words: Sequence[str]) -> tuple[dict[str, Any], str]:
    """Return the settings that words name, as nested tables, and the first word that names none; empty for all.

    Raises:
        UsageError: A setting lacks its value.
    """
    tables: dict[str, Any] = {}
    place = 0
    while place < len(words):
        word, equals, value = words[place].partition("=")
        flag = _ANY_CASE.get(word.replace("_", "-").lower(), "")
        if not flag:
            return tables, words[place]
        setting, switch = SETTING_FLAGS[flag]
        end = next((n for n in range(place + 1, len(words)) if words[n].startswith("--")), len(words))
        values = [value] if equals else [*words[place + 1 : end]]
        found, used = _value(flag, setting.kind, values, switch)
        *path, last = setting.name.split(".")
        table = tables
        for part in path:
            table = table.setdefault(part, {})
        table[last] = found
        place += 1 if equals else 1 + used
    return tables, ""


def _value(flag: str, kind: Any, values: Sequence[str], switch: bool) -> tuple[Any, int]:
    """Return the value as TOML would have it, and how many words it takes; the setting itself checks it."""
    base = parts_of(kind)[0]
    if base is bool:
        return switch, 0
    if not values:
        raise UsageError(f"{flag} needs a value")
    origin, items = get_origin(base) or base, get_args(base)
    if origin is tuple:
        return [_plain(value, items[0]) for value in values], len(values)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        if len(values) % 2:
            raise UsageError(f"{flag} needs pairs of a name and a value (got {' '.join(values)})")
        pairs = zip(values[::2], values[1::2], strict=True)
        return {name: _plain(value, items[1]) for name, value in pairs}, len(values)
    return _plain(values[0], base), 1


def _plain(word: str, kind: Any) -> Any:
    """The number in a word where the setting is or may be one; else the word."""
    base = parts_of(kind)[0]
    base = optional_of(base) or base
    for number, kinds in ((int, (int, float, Any)), (float, (float, Any))):
        with suppress(ValueError):
            if base in kinds:
                return number(word)
    return word
