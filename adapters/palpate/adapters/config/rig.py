"""The rig file: the only place that names hardware."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from palpate.adapters.config.toml import overlay, read_toml
from palpate.core.errors import ConfigurationError, require_in


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
class WatchdogTable:
    """What stops the arm when something has gone quiet, in whatever the program is busy with.

    Attributes:
        command_ms: Age of the newest command at which another thread stops the arm.
        sensor_ms: Time without a new sample of a sensor after which reading it is an error, on the way to the ready
            pose too, where no supervisor watches.
        process_ms: Time without a tick after which a process of its own calls ``stop_function``.
        stop_function: ``package.module:function`` that brings the arm to rest on a way of its own, whatever has become
            of this program; empty for none, and then there is no such process.
    """

    command_ms: float = 200.0
    sensor_ms: float = 500.0
    process_ms: float = 500.0
    stop_function: str = ""

    def __post_init__(self) -> None:
        for name in ("command_ms", "sensor_ms", "process_ms"):
            require_in(f"watchdog.{name}", getattr(self, name), 20.0, 60_000.0)


@dataclass(frozen=True)
class RigFile:
    """A rig, as a TOML file describes it.

    Its tables are ``[rig]``, ``[arm]``, ``[force_sensor]``, ``[operator]`` and ``[watchdog]``.

    Attributes:
        name: Name for logs; the file's own if it gives none.
        arm: The arm.
        force_sensor: The force sensor.
        approach_rad_s: Joint speed of the move to the ready pose, before the first trial.
        operator: What stops the arm at a person's word.
        watchdog: What stops it when something has gone quiet.
    """

    name: str
    arm: DeviceEntry
    force_sensor: DeviceEntry
    approach_rad_s: float = 0.2
    operator: OperatorTable = field(default_factory=lambda: OperatorTable())
    watchdog: WatchdogTable = field(default_factory=lambda: WatchdogTable())

    def __post_init__(self) -> None:
        require_in("rig.approach_rad_s", self.approach_rad_s, 0.001, 2.0)

    @classmethod
    def load(cls, path: Path) -> RigFile:
        """Read a rig file.

        Raises:
            ConfigurationError: It is missing, no TOML, or does not say what a rig is.
        """
        table = read_toml(path)
        unknown = sorted(set(table) - {"rig", "arm", "force_sensor", "operator", "watchdog"})
        if unknown:
            accepted = f"the tables rig, arm, force_sensor, operator and watchdog in {path}"
            raise ConfigurationError(unknown[0], table[unknown[0]], accepted)
        rig = _optional(path, table, "rig")
        strange = sorted(set(rig) - {"name", "approach_rad_s"})
        if strange:
            raise ConfigurationError(f"rig.{strange[0]}", rig[strange[0]], "name or approach_rad_s")
        name, speed = rig.get("name", path.stem), rig.get("approach_rad_s", cls.approach_rad_s)
        if not isinstance(name, str) or not name:
            raise ConfigurationError("rig.name", name, "a name")
        if isinstance(speed, bool) or not isinstance(speed, (int, float)):
            raise ConfigurationError("rig.approach_rad_s", speed, "a number")
        operator = overlay(OperatorTable(), _optional(path, table, "operator"), "operator.")
        watchdog = overlay(WatchdogTable(), _optional(path, table, "watchdog"), "watchdog.")
        arm, sensor = _device(path, table, "arm"), _device(path, table, "force_sensor")
        return cls(name, arm, sensor, float(speed), operator, watchdog)


def _device(path: Path, table: Mapping[str, Any], name: str) -> DeviceEntry:
    entry = dict(_table(path, table, name))
    adapter = entry.pop("adapter", None)
    if not isinstance(adapter, str) or not adapter:
        raise ConfigurationError(f"{name}.adapter", adapter, f"the name of an adapter, in {path}")
    return DeviceEntry(adapter, entry)


def _optional(path: Path, table: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    return _table(path, table, name) if name in table else {}


def _table(path: Path, table: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    value = table.get(name)
    if not isinstance(value, Mapping):
        raise ConfigurationError(name, value, f"a table [{name}] in {path}")
    return value
