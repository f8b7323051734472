"""The ``palpate settings`` command, which prints every setting in a group."""

import shutil
import sys
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any

import tyro

from palpate.adapters import config
from palpate.adapters.cli.commands import COMMANDS, options_of
from palpate.adapters.cli.help import flag_of, options_in
from palpate.adapters.hardware import adapter_names, load_maker, settings_table
from palpate.core.errors import require_one_of
from palpate.core.ports import Settings


@dataclass(frozen=True)
class SettingsOptions(Settings):
    """Print the settings in a group: type, range, unit, default and help. Without a group, print the groups."""

    group: Annotated[str, tyro.conf.Positional] = ""
    """Group, or the dotted name of a table or setting in it, such as task, learning.belief or task.step_mm."""


def settings(options: SettingsOptions) -> None:
    """Print groups or settings."""
    groups = dict(_groups())
    name, wide = options.group, shutil.get_terminal_size((118, 0)).columns
    if not name:
        lines = [f"  {group:24} {len(found[1]):3}  {found[0]}" for group, found in groups.items()]
        sys.stdout.write("palpate settings GROUP prints those of a group; a flag is --NAME VALUE, in TOML [GROUP].\n")
        sys.stdout.write("\n".join((*lines, "")))
        return
    group = next((group for group in groups if name == group or name.startswith(f"{group}.")), name)
    require_one_of("group", group, tuple(groups))
    found = [each for each in groups[group][1] if name in (group, each.name) or each.name.startswith(f"{name}.")]
    require_one_of("group", name if not found else group, tuple(groups))
    for each in found:
        sys.stdout.write(_entry(each, wide))


def _groups() -> Iterator[tuple[str, tuple[str, list[config.Described]]]]:
    """Return every group with its purpose and settings: those for runs, rig files and commands."""
    every = list(config.described(config.RunConfig))
    yield "presets", ("Presets, arm and seed.", [each for each in every if "." not in each.name])
    for field in fields(config.RunConfig):
        found = [each for each in every if each.name.startswith(f"{field.name}.")]
        if found:
            yield field.name, (_purpose(type(getattr(config.RunConfig(), field.name))), found)
    for kind, table in (("arm", "arm"), ("force", "force_sensor")):
        for name in adapter_names(kind):
            declared = settings_table(load_maker(kind, name))
            if declared is not None:
                found = list(config.described(declared, f"{table}."))
                yield f"{table}.{name}", (f"Rig file, [{table}] with adapter = {name!r}.", found)
    for of_rig in (config.SensorFactsTable, config.WatchdogTable, config.OperatorTable):
        yield of_rig.TABLE, (f"Rig file: {_purpose(of_rig)}", list(config.described(of_rig, f"{of_rig.TABLE}.")))
    for command in (name for name, found in COMMANDS.items() if found.module):
        *_, rare = options_in(options_of(command))
        if rare:
            options = [replace(option, name=flag_of(option)) for option in rare]
            yield command, (f"Further options of palpate {command}.", options)


def _purpose(table: type[Any]) -> str:
    return (table.__doc__ or "").partition("\n")[0].partition(". ")[0].rstrip(".") + "."


def _entry(setting: config.Described, wide: int) -> str:
    default = "none" if setting.default is None else config.literal(setting.default)
    head = f"{setting.name} = {default}"
    accepted = f"{setting.accepted}{f', {setting.unit}' if setting.unit else ''}"
    text = textwrap.fill(setting.text, wide, initial_indent="    ", subsequent_indent="    ", break_on_hyphens=False)
    return f"{head}\n    ({accepted})\n{text}\n"
