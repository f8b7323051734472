"""The ``palpate rig new`` command, which prints a rig or job file with all settings and their meanings."""

import sys
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Final

from palpate.adapters import config
from palpate.adapters.hardware import adapter_names, load_maker, settings_table
from palpate.core.job import JOB_TABLES, STATED, Job
from palpate.core.ports import OneOf, Settings

_BEGIN: Final = """# Change what differs on your bench, then examine the devices before anything moves:
#   palpate rig doctor --rig FILE
#   palpate rig doctor --rig FILE --push    # a person pushes the tool: are the signs right?
#   palpate rig doctor --rig FILE --move    # each joint moves by 0.001 rad; a hand at the emergency stop
"""
_MODEL: Final = "Kinematic model, by name; or urdf, flange and posture_rad; a UR takes calibration = FILE, too."
_COLUMN, _WIDTH = 36, 118
"""Column for the comments, and maximum line length."""


@dataclass(frozen=True)
class NewOptions(Settings):
    """Print a rig file for an arm and a force sensor, with all settings, their defaults and their meanings.

    Redirect the output to a file:

      palpate rig new --arm ur-rtde --force ati-netft > rig.toml
      palpate rig new --job > job.toml
    """

    arm: Annotated[str, OneOf("", *adapter_names("arm"))] = ""
    """Adapter for the arm."""
    force: Annotated[str, OneOf("", *adapter_names("force"))] = ""
    """Adapter for the force sensor."""
    model: str = ""
    """Name of the arm's kinematic model, such as ur5e."""
    job: bool = False
    """Print a job file instead, with the part, tool, place and limits for the paper's peg."""


def new(options: NewOptions) -> None:
    """Print the requested file."""
    if options.job:
        sys.stdout.write(job_text())
        return
    for kind in ("arm", "force"):
        given = bool(getattr(options, kind))
        options.require(kind, given, f"the name of an adapter: {', '.join(adapter_names(kind))}")
    sys.stdout.write(rig_text(options.arm, options.force, options.model))


def rig_text(arm: str, force: str, model: str = "") -> str:
    """Return the text of a rig file with these adapters' defaults."""
    rig = {"job": "job.toml", "approach_rad_s": 0.1, "name": f"{arm} with {force}"}
    facts = "What the sensor does not report itself; palpate rig doctor measures the noise."
    tables: list[tuple[str, str, Iterator[str]]] = [
        ("rig", "", _lines(config.RigFile, rig)),
        ("arm", "", _device("arm", arm, [_line("name", model, _MODEL)])),
        ("force_sensor", "", _device("force", force, [])),
        ("force_sensor.facts", facts, _lines(config.SensorFactsTable)),
        ("watchdog", "", _lines(config.WatchdogTable)),
        ("operator", "", _lines(config.OperatorTable)),
    ]
    lines = [_BEGIN, f"format = {config.RIG_FORMAT}"]
    for name, comment, settings in tables:
        lines += ["", *([f"# {comment}"] if comment else []), f"[{name}]", *settings]
    return "\n".join(lines) + "\n"


def job_text() -> str:
    """Return the text of a job file for the paper's peg; optional settings are comments."""
    lines = ["# Lines that begin with # show the defaults."]
    for name in JOB_TABLES:
        table = getattr(Job(), name)
        lines += ["", f"[{name}]"]
        for setting in config.described(type(table)):
            stated = setting.name in STATED.get(name, ())
            lines.append(_line(setting.name, setting.default, setting.text, stated=stated))
    return "\n".join(lines) + "\n"


def _device(kind: str, name: str, more: list[str]) -> Iterator[str]:
    yield _line("adapter", name, "")
    yield from more
    table = settings_table(load_maker(kind, name))
    yield from ["# See its package for its settings."] if table is None else _lines(table)


def _lines(table: type[Settings], values: dict[str, Any] | None = None) -> Iterator[str]:
    """Yield a line for each setting in a table, or only for those in ``values``."""
    for setting in config.described(table):
        if values is None or setting.name in values:
            yield _line(setting.name, (values or {}).get(setting.name, setting.default), setting.text)


def _line(name: str, value: Any, text: str, *, stated: bool = True) -> str:
    """Return a setting with its comment; a long comment goes above it. A setting without a value is commented out."""
    empty = value is None or value in ("", (), {})
    setting = f"{name} = {'...' if empty else config.literal(value)}"
    setting = f"# {setting}" if empty or not stated else setting
    comment = text.replace("``", "")
    line = f"{setting:<{_COLUMN - 2}}  # {comment}" if comment else setting
    if len(line) <= _WIDTH:
        return line
    above = textwrap.wrap(comment, _WIDTH, initial_indent="# ", subsequent_indent="# ", break_on_hyphens=False)
    return "\n".join((*above, setting))
