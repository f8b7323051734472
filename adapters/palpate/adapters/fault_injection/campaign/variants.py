"""The faults of the campaign, and what may be expected of each."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from palpate.adapters.fault_injection.plan import FaultPlan
from palpate.core.ports import SensorFacts
from palpate.core.supervision import SupervisionConfig

_LATE: Final = 3
"""Ticks that a stop may take after the first sign."""


@dataclass(frozen=True)
class Variant:
    """One way in which something goes wrong.

    Attributes:
        plans: Settings of the fault plans, but for tick and seed; more than one where faults come together.
        silent_ticks: Ticks that pass before anything can be seen of it at the ports: a sensor that delivers nothing
            looks like a slow one until its patience is over, and a frozen one like one that measures the same twice.
            None when that depends on what the arm does meanwhile, as with an arm that does not move: then
            only harm counts.
        hidden: No single sample shows it: the sensor lies plausibly. What it did is listed as residual risk.
        noise_share: How much noise the force sensor then shows, as a share of its own on every channel.
    """

    name: str
    plans: tuple[Mapping[str, Any], ...]
    silent_ticks: int | None = 0
    hidden: bool = False
    noise_share: float = 0.0

    def at(self, tick: int, seed: int, sensor: SensorFacts) -> list[FaultPlan]:
        """The faults, beginning at this tick."""
        noise = [
            {"kind": "noise", "port": "force_sensor", "magnitude": self.noise_share * deviation, "channels": channels}
            for deviation, channels in ((sensor.noise_N, (0, 1, 2)), (sensor.noise_Nm, (3, 4, 5)))
            if self.noise_share * deviation > 0.0
        ]
        return [
            FaultPlan(first_tick=tick, seed=seed + number, **plan) for number, plan in enumerate((*self.plans, *noise))
        ]

    @property
    def patience_ticks(self) -> int | None:
        """Ticks from its delivery to the stop that are still in time; None when they are not known beforehand."""
        return None if self.silent_ticks is None else self.silent_ticks + _LATE


def variants(config: SupervisionConfig) -> list[Variant]:
    """Every kind of fault on every port that has it, at strengths that matter."""
    made = _Maker(config)
    for port in ("force_sensor", "joint_encoder"):
        made.add(f"{port} drops all", made.quiet_ticks, kind="drop", port=port)
        made.add(f"{port} drops one in three", None, kind="drop", port=port, probability=0.33)
        made.add(f"{port} 3 ticks late", None, kind="delay", port=port, delay_ticks=3)
        made.add(f"{port} half a second late", made.quiet_ticks, kind="delay", port=port, delay_ticks=70)
        made.add(f"{port} duplicates", None, kind="duplicate", port=port, probability=0.5)
        made.add(f"{port} repeats", made.quiet_ticks, kind="repeat", port=port)
        made.add(f"{port} not a number", 0, kind="nan", port=port)
        made.add(f"{port} disconnected", 0, kind="disconnect", port=port)
    made.add("force_sensor frozen", config.max_equal_samples, kind="freeze", port="force_sensor")
    made.add("force_sensor drifts 5 N/s", None, hidden=True, kind="bias-drift", port="force_sensor", magnitude=5.0,
             channels=(2,))  # fmt: skip
    made.add("force_sensor spike 100 N", 0, kind="spike", port="force_sensor", magnitude=100.0, channels=(2,),
             duration_ticks=1)  # fmt: skip
    made.add("force_sensor saturated, marked", 0, kind="saturate", port="force_sensor", magnitude=2.0)
    made.add("force_sensor saturated, not marked", None, hidden=True, kind="saturate", port="force_sensor",
             magnitude=2.0, honest=False)  # fmt: skip
    made.add("force_sensor in grams", None, kind="unit", port="force_sensor", factor=1000.0)
    made.add("force_sensor in kgf", None, hidden=True, kind="unit", port="force_sensor", factor=1.0 / 9.80665)
    made.add("joint_encoder frozen", None, kind="freeze", port="joint_encoder")
    made.add("joint_encoder drifts 2 mrad/s", None, hidden=True, kind="bias-drift", port="joint_encoder",
             magnitude=2e-3, channels=(2,))  # fmt: skip
    made.add("joint_encoder spike 0.1 rad", 0, kind="spike", port="joint_encoder", magnitude=0.1, channels=(1,))
    made.add("joint_encoder in degrees", 0, kind="unit", port="joint_encoder", factor=57.29577951308232)
    made.add("arm loses all commands", None, kind="drop", port="arm")
    made.add("arm loses one command in three", None, kind="drop", port="arm", probability=0.33)
    made.add("arm 3 ticks late", None, kind="delay", port="arm")
    made.add("arm not a number", 0, kind="nan", port="arm")
    made.add("arm disconnected", 0, kind="disconnect", port="arm")
    made.add("arm stuck", None, kind="stuck", port="arm")
    made.add("arm in degrees", None, kind="unit", port="arm", factor=57.29577951308232)
    made.add("clock jumps 1 s", 0, kind="clock-jump", port="clock", time_s=1.0)
    made.add("ticks take 0.1 s", 0, kind="overrun", port="clock", time_s=0.1)
    made.add("ticks take 10 ms longer", None, kind="overrun", port="clock", time_s=0.01, probability=0.2)
    return made.variants


@dataclass
class _Maker:
    config: SupervisionConfig
    variants: list[Variant] = field(default_factory=list)

    @property
    def quiet_ticks(self) -> int:
        """How long a sensor may be silent before the supervisor calls it dead."""
        return self.config.max_repeats

    def add(self, name: str, silent_ticks: int | None, *, hidden: bool = False, **plan: Any) -> None:
        self.variants.append(Variant(name, (plan,), silent_ticks, hidden))
