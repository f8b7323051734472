"""The rig file: the only place that names hardware."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from palpate.adapters.toml_config import overlay, read_toml
from palpate.core.checks import require_in
from palpate.core.errors import ConfigurationError


@dataclass(frozen=True)
class DeviceEntry:
    """One device of a rig.

    Attributes:
        adapter: Name of the adapter.
        settings: Whatever it wants to know.
    """

    adapter: str
    settings: Mapping[str, Any]


@dataclass(frozen=True)
class OperatorTable:
    """What stops the arm at a person's word, besides the emergency stop.

    Attributes:
        keys: Any key in the terminal.
        file: A file that appears, as a laboratory's button may make it; empty for none.
        socket: A connection to a Unix socket at this path; empty for none.
    """

    keys: bool = True
    file: str = ""
    socket: str = ""


@dataclass(frozen=True)
class RigFile:
    """A rig, as a TOML file describes it: tables ``[rig]``, ``[arm]``, ``[force_sensor]`` and ``[operator]``.

    Attributes:
        name: Name for logs; the file's own if it gives none.
        arm: The arm.
        force_sensor: The force sensor.
        approach_rad_s: Joint speed of the move to the ready pose, before the first trial.
        operator: What stops the arm at a person's word.
    """

    name: str
    arm: DeviceEntry
    force_sensor: DeviceEntry
    approach_rad_s: float = 0.2
    operator: OperatorTable = field(default_factory=lambda: OperatorTable())

    def __post_init__(self) -> None:
        require_in("rig.approach_rad_s", self.approach_rad_s, 0.001, 2.0)

    @classmethod
    def load(cls, path: Path) -> RigFile:
        """Read a rig file.

        Raises:
            ConfigurationError: It is missing, no TOML, or does not say what a rig is.
        """
        table = read_toml(path)
        unknown = sorted(set(table) - {"rig", "arm", "force_sensor", "operator"})
        if unknown:
            accepted = f"the tables rig, arm, force_sensor and operator in {path}"
            raise ConfigurationError(unknown[0], table[unknown[0]], accepted)
        rig = _table(path, table, "rig") if "rig" in table else {}
        strange = sorted(set(rig) - {"name", "approach_rad_s"})
        if strange:
            raise ConfigurationError(f"rig.{strange[0]}", rig[strange[0]], "name or approach_rad_s")
        name, speed = rig.get("name", path.stem), rig.get("approach_rad_s", cls.approach_rad_s)
        if not isinstance(name, str) or not name:
            raise ConfigurationError("rig.name", name, "a name")
        if isinstance(speed, bool) or not isinstance(speed, (int, float)):
            raise ConfigurationError("rig.approach_rad_s", speed, "a number")
        operator = overlay(OperatorTable(), _table(path, table, "operator") if "operator" in table else {}, "operator.")
        return cls(name, _device(path, table, "arm"), _device(path, table, "force_sensor"), float(speed), operator)


def _device(path: Path, table: Mapping[str, Any], name: str) -> DeviceEntry:
    entry = dict(_table(path, table, name))
    adapter = entry.pop("adapter", None)
    if not isinstance(adapter, str) or not adapter:
        raise ConfigurationError(f"{name}.adapter", adapter, f"the name of an adapter, in {path}")
    return DeviceEntry(adapter, entry)


def _table(path: Path, table: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    value = table.get(name)
    if not isinstance(value, Mapping):
        raise ConfigurationError(name, value, f"a table [{name}] in {path}")
    return value
