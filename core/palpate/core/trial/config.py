"""Task settings as specified by the user, in the paper's units (mm, kgf)."""

from dataclasses import dataclass, field
from math import sqrt
from typing import Annotated, ClassVar, Final

from typing_extensions import override

from palpate.core.ports import PERIOD_S, OneOf, Range, Settings

N_PER_KGF: Final = 9.80665
_IN_TIME: Final = 0.95
"""Fraction of the maximum speed at which the tip keeps up with successive steps."""


@dataclass(frozen=True)
class GoalConfig(Settings):
    """Nominal hole pose in the arm's base frame."""

    TABLE: ClassVar[str] = "task.goal"

    x_mm: Annotated[float, Range(-3000.0, 3000.0)] = 400.0
    """Distance forward from the arm's base."""
    y_mm: Annotated[float, Range(-3000.0, 3000.0)] = 0.0
    """Distance leftward from the arm's base."""
    z_mm: Annotated[float, Range(-3000.0, 3000.0)] = 20.0
    """Plate surface height."""
    rpy_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Roll, pitch and yaw of the hole about the base axes; all 0 if it points straight down."""


@dataclass(frozen=True)
class TaskConfig(Settings):
    """Settings for a task's trials. Settings for peg, hole, exploration and actions apply only to insertions."""

    TABLE: ClassVar[str] = "task"

    name: str = "insertion"
    """The task: insertion, insertion-6dof, or a task from another package; --task NAME for short."""
    options: dict[str, float] = field(default_factory=dict)
    """Settings for that task only, as names and values."""
    goal: GoalConfig = GoalConfig()
    start_uncertainty_mm: Annotated[float, Range(0.0, 50.0)] = 3.0
    """Maximum distance from the nominal goal to a trial's start."""
    start_shape: Annotated[str, OneOf("disc", "ball")] = "disc"
    """disc: uniform over the circle; ball: uniform in a ball, projected onto the plate."""
    area_half_width_mm: Annotated[float, Range(0.1, 50.0)] = 3.5
    """Half the side length of the square exploration area."""
    area_centre: Annotated[str, OneOf("goal", "start")] = "goal"
    """goal: the area is centred at the nominal goal; start: at the trial's start, as in the paper."""
    step_mm: Annotated[float, Range(0.01, 5.0)] = 0.7
    """Length of one exploratory step."""
    slide_speed_mm_s: Annotated[float, Range(0.1, 100.0)] = 32.84
    """Maximum speed on the plate, at which a wedged peg stops within the force limit."""
    directions: Annotated[int, Range(2, 360)] = 8
    """Number of step directions for the policy, evenly spaced about the hole's axis."""
    ticks_per_action: Annotated[int, Range(2, 1400)] = 14
    """Control ticks per action at 140 Hz; 14 give ten actions a second."""
    motion_duty: Annotated[float, Range(0.1, 1.0)] = 0.8
    """Fraction of an action's time during which the tip moves; the torque settles during the rest. 1 means no pause."""
    time_limit_s: Annotated[float, Range(0.1, 3600.0)] = 20.0
    """Time after which exploration ends."""
    contact_kgf: Annotated[float, Range(0.01, 10.0)] = 0.10
    """Reaction force along the tool axis above which there is contact."""
    press_kgf: Annotated[float, Range(0.02, 10.0)] = 0.5
    """Force with which the peg is pressed on the plate."""
    insertion_press_kgf: Annotated[float, Range(0.0, 10.0)] = 0.0
    """Force with which the peg is pressed into the hole; 0 uses task.press_kgf."""
    friction: Annotated[float, Range(0.0, 2.0)] = 0.6
    """Maximum coefficient of friction between peg and part; bounds the friction on a wall."""
    end_tilt_mm: Annotated[float, Range(0.0, 10.0)] = 0.0
    """Height difference between the two sides of a tilted peg's end, lost when the walls align the peg: radius times
    tilt."""
    tilt_mrad: Annotated[float, Range(0.0, 200.0)] = 0.0
    """Maximum angle between the peg and hole axes that the walls may correct by bending the gripper."""
    lever_mm: Annotated[float, Range(10.0, 500.0)] = 60.0
    """Maximum lever, about the tip, of a force on the peg or of its inertia."""
    insertion_depth_mm: Annotated[float, Range(0.5, 60.0)] = 10.0
    """Required insertion depth."""
    depth_tolerance_mm: Annotated[float, Range(0.01, 5.0)] = 0.2
    """Maximum shortfall in the estimated depth; covers errors from encoders, force noise and contact height."""
    release_s: Annotated[float, Range(0.0, 10.0)] = 0.0
    """Time without pressing during which an inserted peg must not move; 0 ends the trial while pressing."""
    surface_uncertainty_mm: Annotated[float, Range(0.0, 5.0)] = 0.5
    """Maximum error in the plate's nominal height; matters if the peg never touches the plate."""
    play_mm: Annotated[float, Range(0.0, 30.0)] = 0.0
    """Lateral peg play in the hole; 0 computes it from the shapes and the wear."""
    chamfer_mm: Annotated[float, Range(0.0, 10.0)] = 0.0
    """Additional play in the hole's mouth from chamfers or broken edges; 0 computes a value of at least 0.2."""
    max_force_N: Annotated[float, Range(1.0, 500.0)] = 30.0
    """Measured force above which the trial ends immediately. A trial with a true peak above it is not a success."""
    ready_height_mm: Annotated[float, Range(0.5, 100.0)] = 3.0
    """Height above the plate at which the sensor is tared and the approach begins."""
    travel_speed_mm_s: Annotated[float, Range(1.0, 100.0)] = 20.0
    """Speed in free space."""
    tare_ticks: Annotated[int, Range(1, 1400)] = 28
    """Number of samples averaged for taring, after the same number of stationary ticks."""

    @property
    def insertion_press_N(self) -> float:
        """Return the force with which the peg is pressed into the hole."""
        return (self.insertion_press_kgf or self.press_kgf) * N_PER_KGF

    @property
    def longest_step_m(self) -> float:
        """Return the longest step on the plate that the tip can complete in one action."""
        return _IN_TIME * self.slide_speed_mm_s * 1e-3 * self.motion_duty * self.ticks_per_action * PERIOD_S

    @override
    def check(self) -> None:
        contact = f"more than task.contact_kgf = {self.contact_kgf:g}"
        self.require("press_kgf", self.press_kgf > self.contact_kgf, contact)
        presses = not self.insertion_press_kgf or self.insertion_press_kgf > self.contact_kgf
        self.require("insertion_press_kgf", presses, f"0, or {contact}")
        press_N = max(self.press_kgf * N_PER_KGF, self.insertion_press_N)
        self.require("max_force_N", self.max_force_N > press_N, f"more than the pressing force, {press_N:.3g} N")
        accepted = f"at most task.area_half_width_mm = {self.area_half_width_mm:g}, or trials start outside the"
        inside = self.area_centre != "goal" or self.start_uncertainty_mm <= self.area_half_width_mm
        self.require("start_uncertainty_mm", inside, f"{accepted} exploration area")


@dataclass(frozen=True)
class ControlConfig(Settings):
    """Motion controller gains and parameters for the core's gripper model."""

    TABLE: ClassVar[str] = "control"

    damping_N_s_per_m: float = 400.0
    """Damping B of the damping controller along the tool axis."""
    position_gain_per_s: float = 70.0
    """Gain K of the position controller across the tool axis."""
    force_integral_m_per_N_s: float = 0.00025
    """Integral gain of the lateral force controller during insertion."""
    force_proportional_m_per_N: float = 0.0
    """Proportional gain of the lateral force controller during insertion."""
    axial_stiffness_N_per_mm: Annotated[float, Range(0.1, 1e5)] = 5.0
    """Gripper stiffness along the tool axis; depth is corrected by force divided by stiffness."""
    lateral_stiffness_N_per_mm: Annotated[float, Range(0.1, 1e5)] = 40.0
    """Gripper stiffness across the tool axis; bounds the lateral gains."""
    moving_mass_kg: Annotated[float, Range(0.0, 100.0)] = 0.3
    """Mass on the gripper's springs."""
    damping_ratio: Annotated[float, Range(0.0, 5.0)] = 0.7
    """Damping ratio of the gripper's springs; with the mass, it determines by how much the force leads the spring
    deflection."""
    rigid_mass_kg: Annotated[float, Range(0.0, 100.0)] = 0.05
    """Mass between force sensor and springs."""
    tilt_stiffness_Nm_per_rad: Annotated[float, Range(0.1, 1e5)] = 50.0
    """Gripper stiffness against tilting; bounds the torque of a tilted peg in its hole."""

    def damping_s(self, stiffness_N_per_m: float) -> float:
        """Return the damping of one of the gripper's springs divided by its stiffness, in s."""
        return 2.0 * self.damping_ratio * sqrt(self.moving_mass_kg / stiffness_N_per_m)
