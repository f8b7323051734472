"""The rig file, the only configuration that names hardware."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, TypeAlias

from typing_extensions import override

from palpate.adapters.config.calibration import CalibrationTable
from palpate.adapters.config.toml import merged, overlay, read_toml
from palpate.core.errors import ConfigurationError, UsageError
from palpate.core.job import ToolConfig
from palpate.core.motion import ArmDescription, arm_of_table
from palpate.core.ports import Holds, Range, SensorFacts, Settings, Vector3, fitted, kinds_of, require_keys


@dataclass(frozen=True)
class DeviceEntry:
    """A device in a rig."""

    adapter: str
    settings: Mapping[str, Any]


_AboveZero: Final = Holds(lambda each: min(each) > 0.0, "three numbers above 0, one per axis")
_Noise: TypeAlias = Annotated[float, Range(0.0, 100.0, above=True)]
_Ranges: TypeAlias = Annotated[Vector3, _AboveZero]


@dataclass(frozen=True)
class SensorFactsTable(Settings):
    """Force sensor properties, from the rig file or reported by the sensor. Unknown properties are None."""

    TABLE: ClassVar[str] = "force_sensor.facts"

    noise_N: _Noise | None = None
    """Standard deviation of one force channel while the sensor is stationary; ``palpate rig doctor`` measures it."""
    noise_Nm: _Noise | None = None
    """Standard deviation of one torque channel while the sensor is stationary."""
    range_N: _Ranges | None = None
    """Maximum force along each axis."""
    range_Nm: _Ranges | None = None
    """Maximum torque about each axis."""
    rate_Hz: Annotated[float, Range(1.0, 100_000.0)] | None = None
    """Sampling rate."""
    frame: Annotated[str, Holds(bool, "the name of a frame")] | None = None
    """Frame for the samples. Default: sensor."""

    def noise(self) -> SensorFacts | None:
        """Return the noise and range, from which settings are derived, or None if no noise is specified."""
        if self.noise_N is None or self.noise_Nm is None:
            return None
        ranges = {name: found for name in ("range_N", "range_Nm") if (found := getattr(self, name)) is not None}
        return SensorFacts(self.noise_N, self.noise_Nm, **ranges)


@dataclass(frozen=True)
class OperatorTable(Settings):
    """Operator stop, in addition to the emergency stop."""

    TABLE: ClassVar[str] = "operator"

    keys: bool = True
    """Stop the arm when any key is pressed in the terminal."""


RIG_FORMAT: Final = 2
"""Format number of rig files; the ``format`` key is optional."""


@dataclass(frozen=True)
class WatchdogTable(Settings):
    """Watchdog that stops the arm when the control loop sends no set-points."""

    TABLE: ClassVar[str] = "watchdog"

    setpoint_timeout_ms: Annotated[float, Range(20.0, 60_000.0)] = 100.0
    """Time without a set-point after which the arm process stops the arm."""

    @property
    def timeout_ns(self) -> int:
        """The time-out in ns."""
        return round(self.setpoint_timeout_ms * 1e6)


@dataclass(frozen=True)
class RigFile(Settings):
    """A rig, as described by a TOML file."""

    TABLE: ClassVar[str] = "rig"

    name: Annotated[str, Holds(bool, "a name")]
    """Name of the rig in logs. Default: the file name."""
    arm: DeviceEntry
    """The arm."""
    force_sensor: DeviceEntry
    """The force sensor."""
    approach_rad_s: Annotated[float, Range(0.001, 2.0)] = 0.2
    """Joint speed for the move to the ready pose, before the first trial."""
    arm_lag_ms: Annotated[float, Range(0.0, 500.0)] | None = None
    """Delay between a command and the arm's motion. Default: the delay in the job's limits."""
    operator: OperatorTable = OperatorTable()
    """Operator stop."""
    watchdog: WatchdogTable = WatchdogTable()
    """Watchdog for the control loop."""
    facts: SensorFactsTable = SensorFactsTable()
    """Specified properties of the force sensor."""
    calibration: CalibrationTable = field(default_factory=CalibrationTable)
    """Calibration results."""
    job: str = ""
    """Job file for the rig, used by commands without --job."""
    emulated: bool = False
    """True if all devices are emulated, so that no real device moves; set by `palpate emulate`."""
    real_time_factor: Annotated[float, Range(0.01, 1.0)] = 1.0
    """Speed of the emulated devices relative to real time, or 1 for real devices."""
    accept_kinematics: bool = False
    """True if a person accepts the arm's nominal model for this run; not a key in the file."""
    model: str | ArmDescription = ""
    """Arm model: a name, or the ``[arm]`` table with a URDF; empty if the file has none."""

    @override
    def check(self) -> None:
        self.require("real_time_factor", self.emulated or self.real_time_factor == 1.0, "1, the time of real devices")

    @classmethod
    def load(cls, path: Path) -> RigFile:
        """Read a rig file.

        Raises:
            ConfigurationError: The file is missing, is not TOML, or lacks required fields.
        """
        table = read_toml(path, "rig")
        if (found := table.pop("format", RIG_FORMAT)) != RIG_FORMAT:
            raise ConfigurationError("format", found, f"{RIG_FORMAT}, which this version reads, in {path}")
        require_keys("rig file", table, ["arm", "force_sensor"], ["rig", "operator", "watchdog", "calibration"])
        for name, value in table.items():
            if not isinstance(value, Mapping):
                raise ConfigurationError(name, value, f"a table [{name}] in {path}")
        rig = {"name": path.stem, **table.get("rig", {})}
        require_keys("rig", rig, ["name"], ["approach_rad_s", "arm_lag_ms", "emulated", "real_time_factor", "job"])
        if isinstance(job := rig.get("job"), str) and job:
            rig["job"] = str(path.resolve().parent / job)
        sensor = dict(table["force_sensor"])
        facts = sensor.pop("facts", {})
        if not isinstance(facts, Mapping):
            raise ConfigurationError("force_sensor.facts", facts, f"a table [force_sensor.facts] in {path}")
        arm = dict(table["arm"])
        named = kinds_of(ArmDescription) if "urdf" in arm or "name" in arm else {}
        stated = {key: arm.pop(key) for key in list(arm) if key in named}
        return cls(
            arm=_device(path, arm, "arm"),
            model=fitted("arm", arm_of_table(stated), str | ArmDescription) if stated else "",
            force_sensor=_device(path, sensor, "force_sensor"),
            facts=overlay(SensorFactsTable(), facts),
            operator=overlay(OperatorTable(), table.get("operator", {})),
            watchdog=overlay(WatchdogTable(), table.get("watchdog", {})),
            calibration=overlay(CalibrationTable(), table.get("calibration", {})),
            **rig,
        )

    def laid_over(
        self, table: Mapping[str, Any], job: Mapping[str, Any] | None, arm: str = "", *, measured: bool = True
    ) -> tuple[dict[str, Any], dict[str, Any] | None]:
        """Return the settings and the job, with this rig's arm and measurements and without a simulated cell.

        Raises:
            ConfigurationError: There is no model for the arm.
            UsageError: Neither the settings nor the job specifies the part and tool.
        """
        if job is None and not {"part", "tool"} <= set(table):
            problem = 'a rig needs a job with part and tool: give --job FILE, or a line job = "FILE" in [rig]'
            raise UsageError(f"{problem} of {self.name}")
        drawn = overlay(ToolConfig(), merged(table.get("tool", {}), (job or {}).get("tool", {})))
        found = self.calibration.run_settings(drawn) if measured else {}
        stated = {**table, **(job or {})}.get("arm", "")
        name = stated.get("name", "") if isinstance(stated, Mapping) else str(stated)
        named = arm or name
        # If both name the same arm, the more complete table is used.
        kept = stated and self.model in ("", name) and named == name
        own: dict[str, Any] = {} if kept else {"arm": self.arm_model(named)}
        real = {key: value for key, value in table.items() if key != "cell"}
        drawing = None if job is None else {key: value for key, value in job.items() if key != "cell"}
        if self.arm_lag_ms is not None:
            limits = {"limits": {"lag_ms": self.arm_lag_ms}}
            own, drawing = merged(own, limits), None if drawing is None else merged(drawing, limits)
        return merged(real, found, own), drawing

    def arm_model(self, given: str = "") -> str | ArmDescription:
        """Return the arm model from the file, or the given model if the file has none.

        Raises:
            ConfigurationError: Neither exists, or the two differ.
        """
        if not self.model and not given:
            accepted = (
                'stated: --arm NAME, or in the rig file [arm] name = "ur5e" or another, or urdf, flange and posture_rad'
            )
            raise ConfigurationError("arm", given, accepted)
        if self.model and given not in ("", str(self.model)):
            raise ConfigurationError("arm", given, f"{self.model}, which the rig file has, or none")
        return self.model or given


def _device(path: Path, settings: dict[str, Any], name: str) -> DeviceEntry:
    adapter = settings.pop("adapter", None)
    if not isinstance(adapter, str) or not adapter:
        raise ConfigurationError(f"{name}.adapter", adapter, f"the name of an adapter, in {path}")
    return DeviceEntry(adapter, settings)
