"""Run configuration, as a tree of frozen dataclasses for TOML files, flags and ``run.toml``."""

from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Final, TypeAlias

from typing_extensions import override

from palpate.adapters.config.learning import LearningConfig
from palpate.adapters.config.scenarios import LEARNERS, SCENARIOS
from palpate.core.errors import require_in
from palpate.core.job import LimitsConfig, PartConfig, PlaceConfig, ToolConfig
from palpate.core.motion import ArmDescription
from palpate.core.ports import CHANNELS, CONTROL_RATE_HZ, Holds, OneOf, Range, Settings
from palpate.core.supervision import SupervisionConfig
from palpate.core.trial import ControlConfig, TaskConfig
from palpate.simulation.work_cell import CellConfig

_BELOW_HALF_THE_RATE: Final = Range(
    0.0,
    CONTROL_RATE_HZ / 2,
    above=True,
    below=True,
    text=f"above 0 and below half the control rate, {CONTROL_RATE_HZ / 2:g}",
)
_Factor: TypeAlias = Annotated[float, Holds(lambda factor: factor != 0.0, "a finite number other than zero")]
_Channels: TypeAlias = Annotated[
    tuple[Annotated[str, OneOf(*CHANNELS)], ...],
    Holds(lambda names: 0 < len(names) == len(set(names)), "at least one channel, and none twice"),
]


@dataclass(frozen=True)
class PerceptionConfig(Settings):
    """Processing stages from raw signals to states. Each stage can be replaced separately."""

    TABLE: ClassVar[str] = "perception"

    cutoff_Hz: Annotated[float, _BELOW_HALF_THE_RATE] = 4.0
    """Cut-off frequency of the Butterworth low-pass filter on the six wrench channels."""
    filter_order: Annotated[int, Range(1, 2)] = 2
    """Order of the low-pass filter, 1 or 2."""
    calibration: tuple[_Factor, _Factor, _Factor, _Factor, _Factor, _Factor] = (1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    """Factors applied to Fx, Fy, Fz, Tx, Ty and Tz after taring."""
    features: Annotated[str, OneOf("channels", "pca", "som")] = "channels"
    """channels: chosen from task knowledge; pca: principal components; som: self-organising map."""
    channels: _Channels = ("x", "y", "tx", "ty")
    """Channels to use, or to reduce with pca and som: x y z fx fy fz tx ty tz."""
    components: Annotated[int, Range(1, len(CHANNELS))] = 2
    """Number of principal components for pca."""
    som_side: Annotated[int, Range(2, 50)] = 6
    """Number of rows and of columns of the self-organising map."""
    symbols: Annotated[str, OneOf("regions", "grid", "random", "clusters", "options")] = "regions"
    """regions: the paper's 17; grid: every combination of bands (81); random: random partition; clusters: k-means;
    options: situations that the task defines; the actions are its programmed options."""
    position_threshold_mm: Annotated[float, Range(0.001, 100.0)] = 1.0
    """Distance from the nominal goal below which a position counts as zero."""
    torque_threshold_kgf_mm: Annotated[float, Range(0.001, 1000.0)] = 0.7
    """Torque below which a value counts as zero."""
    symbol_count: Annotated[int, Range(2, 1000)] = 17
    """Number of symbols for random and clusters."""
    fit_trials: Annotated[int, Range(1, 1000)] = 10
    """Number of random-walk trials for fitting pca, som, clusters and the bounds for random."""
    memory: str = "none"
    """none: a state is a symbol; last-action: the last symbol and the kind of action before it; last-2, last-3: the
    last 2 or 3 symbols; an automaton file (.json): its states."""

    @override
    def check(self) -> None:
        if self.features == "pca":
            require_in("perception.components", self.components, 1, len(self.channels))
        plain = self.features == "channels" and self.channels == ("x", "y", "tx", "ty")
        accepted = "random or clusters, unless the features are the channels x y tx ty"
        self.require("symbols", plain or self.symbols not in ("regions", "grid", "options"), accepted)


@dataclass(frozen=True)
class RecordingConfig(Settings):
    """Settings for the flight recorder. Recording does not affect learning or measurements."""

    TABLE: ClassVar[str] = "recording"

    enabled: bool = True
    """Record each trial as a log in the logs subfolder of the run's folder."""
    on_loss: Annotated[str, OneOf("report", "stop")] = "report"
    """Response to a full disk: report it and continue, or stop the trial."""


@dataclass(frozen=True)
class AcceptanceConfig(Settings):
    """Timing limits for an accepted trial. In the simulator, every trial is accepted."""

    TABLE: ClassVar[str] = "acceptance"

    max_late_ms: Annotated[float, Range(0.1, 10_000.0)] = 20.0
    """Maximum tick delay."""
    max_late_share: Annotated[float, Range(0.0, 1.0)] = 0.05
    """Maximum share of ticks that begin more than a millisecond late."""
    max_skipped_share: Annotated[float, Range(0.0, 1.0)] = 0.02
    """Maximum share of schedule slots without a tick."""
    max_repeated_share: Annotated[float, Range(0.0, 1.0)] = 0.9
    """Maximum share of ticks without a new sample; an arm on a bus at half the rate has a share of 0.5."""
    learn_from_flagged: bool = False
    """Also learn from flagged trials."""


@dataclass(frozen=True)
class RealTimeConfig(Settings):
    """Real-time settings for the control loop. A setting that the system rejects is reported, and the run continues."""

    TABLE: ClassVar[str] = "real_time"

    scheduling: bool = False
    """Request the real-time scheduling class (SCHED_FIFO) while a trial runs."""
    priority: Annotated[int, Range(1, 99)] = 50
    """Real-time priority, 1 to 99."""
    lock_memory: bool = False
    """Lock the process's memory, so that it is not paged out."""
    cpu: Annotated[int, Range(-1, 4096)] = -1
    """CPU for the loop while a trial runs; -1 lets the system choose."""
    freeze_objects: bool = False
    """Exempt the objects that exist at the start from garbage collection."""


@dataclass(frozen=True)
class RunConfig(Settings):
    """All settings on which a run depends; its results also depend on package versions."""

    scenario: Annotated[str, OneOf(*SCENARIOS)] = "paper"
    """Preset that the other settings start from. job: no preset, only the job; paper: the hole is at the nominal goal;
    blind: within 3 mm of it; blind with one further condition: blind-tilt-2, blind-tilt-4 (mrad), blind-regrip,
    blind-bias, blind-bias-drawn, blind-drift, blind-noise, blind-batches, blind-wear, blind-corner, blind-smooth,
    blind-rough, blind-tight, blind-5 (mm), blind-grip, blind-plate, blind-yaw; and with grip, plate and yaw, a peg that
    is not round: blind-triangle, blind-square, blind-hexagon, blind-rounded-square, blind-keyed."""
    learner: Annotated[str, OneOf(*LEARNERS)] = "q-learning"
    """Learner: q-learning, sarsa, belief, hmm or options; a preset, like the scenario."""
    arm: str | ArmDescription = "zebra-zero"
    """Arm: zebra-zero, ur3, ur5, ur10, ur3e, ur5e, ur10e, ur16e, ur20, panda, z1, xarm7, or one from another package;
    in TOML, also an [arm] table with the urdf, flange and posture_rad of your own arm."""
    seed: Annotated[int, Range(0, 2**63 - 1)] = 0
    """Seed for all random streams."""
    part: PartConfig = field(default_factory=PartConfig)
    tool: ToolConfig = field(default_factory=ToolConfig)
    place: PlaceConfig = field(default_factory=lambda: PlaceConfig(start_uncertainty_mm=3.0))
    limits: LimitsConfig = field(default_factory=LimitsConfig)
    task: TaskConfig = field(default_factory=TaskConfig)
    cell: CellConfig = field(default_factory=CellConfig)
    perception: PerceptionConfig = field(default_factory=PerceptionConfig)
    control: ControlConfig = field(default_factory=ControlConfig)
    learning: LearningConfig = field(default_factory=LearningConfig)
    recording: RecordingConfig = field(default_factory=RecordingConfig)
    supervision: SupervisionConfig = field(default_factory=SupervisionConfig)
    acceptance: AcceptanceConfig = field(default_factory=AcceptanceConfig)
    real_time: RealTimeConfig = field(default_factory=RealTimeConfig)

    @override
    def check(self) -> None:
        cell, depth_mm = self.cell, self.task.insertion_depth_mm
        accepted = "none with the learner hmm, which finds hidden states itself"
        self.perception.require("memory", self.learner != "hmm" or self.perception.memory == "none", accepted)
        above = f"at least 0.5 mm less than task.ready_height_mm = {self.task.ready_height_mm:g}, or trials begin"
        is_below = cell.hole_height_error_mm <= self.task.ready_height_mm - 0.5
        cell.require("hole_height_error_mm", is_below, f"{above} inside the plate")
        deep = f"at least task.insertion_depth_mm = {depth_mm:g}, or no trial can succeed"
        cell.peg.require("hole_depth_mm", cell.peg.hole_depth_mm >= depth_mm, deep)
