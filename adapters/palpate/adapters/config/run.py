"""The configuration of a run: one tree of frozen dataclasses, for TOML files, flags and ``run.toml`` alike."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import isfinite
from typing import Final

from palpate.adapters.config.real_time import RealTimeConfig
from palpate.core.errors import ConfigurationError, require_in, require_one_of, require_whole
from palpate.core.insertion.config import ControlConfig, TaskConfig
from palpate.core.perception.channels import CHANNELS
from palpate.core.ports.values import CONTROL_RATE_HZ
from palpate.core.supervision.config import SupervisionConfig
from palpate.simulation.work_cell.config import CellConfig


@dataclass(frozen=True)
class PerceptionConfig:
    """From raw signals to states. Each stage can be exchanged on its own."""

    cutoff_Hz: float = 4.0
    """Cut-off of the Butterworth low-pass on the six wrench channels."""
    filter_order: int = 2
    """Its order, 1 or 2."""
    calibration: tuple[float, float, float, float, float, float] = (1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    """Factors on the sensor's Fx Fy Fz Tx Ty Tz after taring."""
    features: str = "channels"
    """channels: chosen by task knowledge; pca: principal components; som: self-organising map."""
    channels: tuple[str, ...] = ("x", "y", "tx", "ty")
    """Channels used (or, for pca and som, reduced): x y z fx fy fz tx ty tz."""
    components: int = 2
    """Components kept by pca."""
    som_side: int = 6
    """The self-organising map has this many rows and columns."""
    symbols: str = "regions"
    """regions: the paper's 17; grid: every combination of bands (81); random: random partition; clusters: k-means."""
    position_threshold_mm: float = 1.0
    """Positions nearer to the nominal goal than this count as zero."""
    torque_threshold_kgf_mm: float = 0.7
    """Torques smaller than this count as zero."""
    symbol_count: int = 17
    """Number of symbols of random and clusters."""
    fit_trials: int = 10
    """Random-walk trials whose samples fit pca, som, clusters and the bounds of random."""
    memory: str = "none"
    """none: a state is a symbol; last-2, last-3: the last symbols; an automaton file (.json): its states."""

    def __post_init__(self) -> None:
        name = "perception."
        if not 0.0 < self.cutoff_Hz < CONTROL_RATE_HZ / 2:
            raise ConfigurationError(
                name + "cutoff_Hz",
                self.cutoff_Hz,
                f"above 0 and below half the control rate, {CONTROL_RATE_HZ / 2:g}",
            )
        require_in(name + "filter_order", self.filter_order, 1, 2)
        if not all(isfinite(factor) and factor != 0.0 for factor in self.calibration):
            raise ConfigurationError(name + "calibration", self.calibration, "six finite numbers other than zero")
        require_one_of(name + "features", self.features, ("channels", "pca", "som"))
        if not self.channels or len(set(self.channels)) < len(self.channels):
            raise ConfigurationError(name + "channels", self.channels, "at least one channel, and none twice")
        for channel in self.channels:
            require_one_of(name + "channels", channel, CHANNELS)
        most = len(self.channels) if self.features == "pca" else len(CHANNELS)
        require_in(name + "components", self.components, 1, most)
        require_in(name + "som_side", self.som_side, 2, 50)
        require_one_of(name + "symbols", self.symbols, ("regions", "grid", "random", "clusters"))
        require_in(name + "position_threshold_mm", self.position_threshold_mm, 0.001, 100.0)
        require_in(name + "torque_threshold_kgf_mm", self.torque_threshold_kgf_mm, 0.001, 1000.0)
        require_in(name + "symbol_count", self.symbol_count, 2, 1000)
        require_in(name + "fit_trials", self.fit_trials, 1, 1000)
        if self.symbols in ("regions", "grid") and (
            self.features != "channels" or self.channels != ("x", "y", "tx", "ty")
        ):
            raise ConfigurationError(
                name + "symbols",
                self.symbols,
                "random or clusters, unless the features are the channels x y tx ty",
            )


@dataclass(frozen=True)
class LearningConfig:
    """Q-learning, what it is rewarded for, and what is programmed beside it."""

    alpha: float = 0.3
    """Learning rate."""
    alpha_visits: float = 50.0
    """Visits that halve the learning rate of a state-action pair; 0 keeps it constant."""
    alpha_floor: float = 0.05
    """The learning rate never falls below this."""
    gamma: float = 1.0
    """Discount."""
    temperature: float = 5.0
    """Boltzmann temperature of the first trial."""
    temperature_decay: float = 0.95
    """Its factor from trial to trial."""
    temperature_floor: float = 0.2
    """It never falls below this: states are aliased, and a greedy policy would loop in them."""
    back_off_visits: float = 0.0
    """With a memory: visits after which a state's own experience counts as much as that of its last symbol, which
    stands in for it until then; 0 for never."""
    reinforcement: str = "action-penalty"
    """action-penalty: -1 per action; effort: force beyond the pressing force costs too."""
    effort_per_N_s: float = -1.0
    """Reward per newton second of that excess."""
    programmed: dict[str, str] = field(default_factory=dict)
    """State name to action name: these states are programmed, not learned."""
    examples: str = ""
    """CSV file with state and action columns (such as decisions.csv of a run): its states act by example."""

    def __post_init__(self) -> None:
        require_in("learning.alpha", self.alpha, 1e-6, 1.0)
        require_in("learning.alpha_floor", self.alpha_floor, 0.0, self.alpha)
        require_in("learning.alpha_visits", self.alpha_visits, 0.0, 1e9)
        require_in("learning.gamma", self.gamma, 0.0, 1.0)
        require_in("learning.temperature", self.temperature, 1e-9, 1e6)
        require_in("learning.temperature_decay", self.temperature_decay, 1e-3, 1.0)
        require_in("learning.temperature_floor", self.temperature_floor, 0.0, self.temperature)
        require_in("learning.back_off_visits", self.back_off_visits, 0.0, 1e9)
        require_one_of("learning.reinforcement", self.reinforcement, ("action-penalty", "effort"))
        require_in("learning.effort_per_N_s", self.effort_per_N_s, -1e6, 0.0)


@dataclass(frozen=True)
class RecordingConfig:
    """The flight recorder. Recording changes nothing that is learned or measured."""

    enabled: bool = True
    """Record every trial, one log each, in the folder logs of the run's folder."""
    when_full: str = "wait"
    """Writer behind and queue full: wait (right where time waits too, in a simulator), or drop and count."""
    queue_kB: int = 4096
    """Size of the queue before the writer."""
    on_trouble: str = "report"
    """Full queue or full disk: report it and go on, or stop the trial."""

    def __post_init__(self) -> None:
        require_one_of("recording.when_full", self.when_full, ("wait", "drop"))
        require_whole("recording.queue_kB", self.queue_kB, 16, 1_000_000)
        require_one_of("recording.on_trouble", self.on_trouble, ("report", "stop"))


@dataclass(frozen=True)
class AdmissionConfig:
    """What a trial's timing must be like for it to count. In the simulator every trial is admitted."""

    max_late_ms: float = 20.0
    """Longest time by which a tick may begin late."""
    max_late_share: float = 0.05
    """Share of ticks that may begin more than a millisecond late."""
    max_skipped_share: float = 0.02
    """Share of the schedule's slots that may go by without a tick."""
    max_repeated_share: float = 0.9
    """Share of ticks in which a sensor may have nothing new; an arm's bus at half the rate has half."""
    learn_from_marked: bool = False
    """Learn from trials that are not admitted, too."""

    def __post_init__(self) -> None:
        require_in("admission.max_late_ms", self.max_late_ms, 0.1, 10_000.0)
        for name in ("max_late_share", "max_skipped_share", "max_repeated_share"):
            require_in(f"admission.{name}", getattr(self, name), 0.0, 1.0)


@dataclass(frozen=True)
class RunConfig:
    """Everything that a run depends on, apart from package versions."""

    scenario: str = "paper"
    """Preset that the other settings start from."""
    arm: str = "zebra-zero"
    """Arm: zebra-zero or ur5."""
    seed: int = 0
    """Every random stream of every trial follows from it."""
    task: TaskConfig = field(default_factory=TaskConfig)
    cell: CellConfig = field(default_factory=CellConfig)
    perception: PerceptionConfig = field(default_factory=PerceptionConfig)
    control: ControlConfig = field(default_factory=ControlConfig)
    learning: LearningConfig = field(default_factory=LearningConfig)
    recording: RecordingConfig = field(default_factory=RecordingConfig)
    supervision: SupervisionConfig = field(default_factory=SupervisionConfig)
    admission: AdmissionConfig = field(default_factory=AdmissionConfig)
    real_time: RealTimeConfig = field(default_factory=RealTimeConfig)

    def __post_init__(self) -> None:
        require_one_of("scenario", self.scenario, tuple(SCENARIOS))
        require_in("seed", self.seed, 0, 2**63 - 1)
        if self.cell.hole_height_error_mm > self.task.ready_height_mm - 0.5:
            raise ConfigurationError(
                "cell.hole_height_error_mm",
                self.cell.hole_height_error_mm,
                f"at least 0.5 mm less than task.ready_height_mm = {self.task.ready_height_mm:g}, or trials begin"
                " inside the plate",
            )
        if self.cell.peg.hole_depth_mm < self.task.insertion_depth_mm:
            raise ConfigurationError(
                "cell.peg.hole_depth_mm",
                self.cell.peg.hole_depth_mm,
                f"at least task.insertion_depth_mm = {self.task.insertion_depth_mm:g}, or no trial can succeed",
            )


SCENARIOS: Final[dict[str, str]] = {
    "paper": "start anywhere within 3 mm, hole at the nominal goal",
    "blind": "the hole itself anywhere within 3 mm of the nominal goal",
}


def scenario(name: str) -> RunConfig:
    """The preset of that name.

    Raises:
        ConfigurationError: There is none.
    """
    require_one_of("scenario", name, tuple(SCENARIOS))
    config = RunConfig(scenario=name)
    if name == "blind":
        config = replace(config, cell=replace(config.cell, hole_uncertainty_mm=3.0))
    return config
