"""Look up palpate's own and third-party adapters by name among the entry points of ``palpate.adapters``.

An entry is named ``arm.NAME`` or ``force.NAME`` and refers to a function that makes an adapter from the settings in a
rig file; ``package.module:function`` needs no entry. The function opens no device, because the life cycle does so.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any, Final, TypeAlias, TypeVar, get_type_hints

from palpate.adapters.config import entries, from_here, imported, overlay
from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.served_arm import ServedArm
from palpate.core.errors import ConfigurationError, PalpateError, describe
from palpate.core.job import ToolConfig
from palpate.core.motion import ArmDescription, Kinematics, ToolGeometry, arm_named
from palpate.core.ports import (
    CONTROL_RATE_HZ,
    ArmCommand,
    Clock,
    CommandLimiter,
    ForceSensor,
    Holds,
    JointEncoder,
    JointVector,
    Settings,
)

GROUP: Final = "palpate.adapters"
T = TypeVar("T")


def _as_it_is() -> None:
    """Do nothing."""


def _to_stderr(line: str) -> None:
    sys.stderr.write(f"palpate: {line}\n")


@dataclass(frozen=True)
class RigContext:
    """Data that an adapter receives in addition to its settings.

    Attributes:
        tool: Tool on the flange according to the job, or None without a job.
        accept_kinematics: True if a person has accepted a nominal model of the arm, or if the rig is emulated.
        set_priority: Function that sets the real-time class and the CPU requested by the run. Each thread that runs arm
            cycles must call it first.
        notify: Function that receives messages from an adapter while it opens its device.
    """

    clock: Clock
    arm: ArmDescription
    lower_rad: JointVector
    upper_rad: JointVector
    velocity_limit_rad_s: JointVector
    set_priority: Callable[[], object] = _as_it_is
    tool: ToolConfig | None = None
    accept_kinematics: bool = False
    notify: Callable[[str], object] = _to_stderr

    @classmethod
    def of(cls, arm: str | ArmDescription, clock: Clock) -> RigContext:
        """Return the context for an arm, given as an object or by name, with the limits from its kinematic model."""
        description = arm_named(arm)
        kinematics = Kinematics(description, ToolGeometry())
        lower, upper, velocity = (
            tuple(limit.tolist())
            for limit in (kinematics.lower_rad, kinematics.upper_rad, kinematics.velocity_limit_rad_s)
        )
        return cls(clock, description, lower, upper, velocity)

    @property
    def limiter(self) -> CommandLimiter:
        """Return a limiter that keeps commands within the joint limits of the arm."""
        return CommandLimiter(self.lower_rad, self.upper_rad, self.velocity_limit_rad_s, CONTROL_RATE_HZ)

    @property
    def real_time_factor(self) -> float:
        """Seconds of rig time per real second, or 1 for real devices."""
        return self.clock.real_time_factor if isinstance(self.clock, MonotonicClock) else 1.0

    def portable(self) -> RigContext:
        """Return the parts of the context that can be sent to another process."""
        none: Any = None
        return replace(self, clock=none, set_priority=_as_it_is, notify=_to_stderr)


@dataclass(frozen=True)
class ArmAdapter:
    """An arm's encoders and servos, which may be the same object."""

    encoder: JointEncoder
    arm: ArmCommand


DeviceSettings: TypeAlias = Mapping[str, Any]
"""A device's settings in a rig file, without the name of its adapter."""
Host: TypeAlias = Annotated[str, Holds(lambda host: bool(host.strip()) and host.isprintable(), "an address")]
ArmMaker: TypeAlias = Callable[[DeviceSettings, RigContext], ArmAdapter | ServedArm]
ForceSensorMaker: TypeAlias = Callable[[DeviceSettings, RigContext], ForceSensor]


def arm_maker(name: str) -> ArmMaker:
    """Return the function that makes the named arm adapter. It raises the same errors as :func:`force_sensor_maker`."""
    kinds: Any = ArmAdapter | ServedArm
    return partial(_made, "arm.adapter", name, kinds, load_maker("arm", name))


def force_sensor_maker(name: str) -> ForceSensorMaker:
    """Return the function that makes the named force sensor adapter.

    Raises:
        ConfigurationError: There is no such adapter, or it cannot be loaded.
    """
    # mypy accepts a class as a type only if it is not a protocol.
    kind: Any = ForceSensor
    return partial(_made, "force_sensor.adapter", name, kind, load_maker("force", name))


def _made(field: str, name: str, kind: type[T], maker: Any, settings: DeviceSettings, context: RigContext) -> T:
    """Return the result of a third-party function, which may fail in any way."""
    table = settings_table(maker)
    try:
        given = settings if table is None else overlay(table(), settings)
    except ConfigurationError as error:
        raise ConfigurationError(error.field, error.value, f"{error.accepted}, with adapter = {name!r}") from error
    try:
        made = maker(given, context)
    except PalpateError:
        raise
    except Exception as error:
        raise ConfigurationError(field, name, f"a function that works; it raised {describe(error)}") from error
    if not isinstance(made, kind):
        wanted = getattr(kind, "__name__", ArmAdapter.__name__)
        raise ConfigurationError(field, name, f"a function that makes an adapter: {wanted}, not {made!r}")
    return made


def settings_table(maker: Callable[..., Any]) -> type[Settings] | None:
    """Return the type of a maker's first parameter if it declares settings, or None if it accepts any mapping."""
    try:
        first = next(iter(get_type_hints(maker).values()), None)
    except (TypeError, NameError):
        return None
    return first if isinstance(first, type) and issubclass(first, Settings) else None


def adapter_names(kind: str) -> list[str]:
    """Return the names of all installed adapters of a kind, ``arm`` or ``force``."""
    return sorted(name.removeprefix(f"{kind}.") for name in entries(GROUP) if name.startswith(f"{kind}."))


def load_maker(kind: str, name: str) -> Any:
    """Return the factory function of an adapter, as defined in its package.

    Raises:
        ConfigurationError: There is no such adapter, or it cannot be loaded.
    """
    found = entries(GROUP)
    field = "force_sensor.adapter" if kind == "force" else "arm.adapter"
    if (entry := found.get(f"{kind}.{name}")) is not None:
        try:
            return entry.load()
        except Exception as error:
            # A third-party package may fail in any way when it is imported.
            accepted = f"an adapter that can be loaded; {entry.value} cannot ({error})"
            raise ConfigurationError(field, name, accepted) from error
    if ":" in name:
        with from_here():
            return imported(field, name, "package.module:function")
    accepted = f"one of {', '.join(adapter_names(kind))}, or package.module:function"
    raise ConfigurationError(field, name, accepted)
