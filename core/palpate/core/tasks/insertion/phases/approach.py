"""The approach, a guarded move straight down to the first contact."""

from typing_extensions import override

from palpate.core.ports import Vector3
from palpate.core.tasks.contact import Monitor, RunningPhase
from palpate.core.tasks.insertion.phases.equipment import Equipment
from palpate.core.trial import N_PER_KGF


class Approach(RunningPhase):
    """Phase that moves the peg straight down until there is a reaction force.

    Attributes:
        touched: True if the plate was touched; if the phase ends without contact, the tip is below the plate.
    """

    def __init__(self, equipment: Equipment, monitor: Monitor) -> None:
        task = equipment.task
        self._state, self._measurement, self._motion = equipment.state, equipment.measurement, equipment.motion
        self._controller, self._monitor = equipment.controllers.press, monitor
        self._contact_N, self._depth_m = task.contact_kgf * N_PER_KGF, task.insertion_depth_mm * 1e-3
        self._tolerance_m, self._slack_m = task.depth_tolerance_mm * 1e-3, task.surface_uncertainty_mm * 1e-3

    def enter(self) -> None:
        """Begin moving straight down from the current position."""
        self.over = self.touched = False
        self._target_m = self._motion.reference_m

    @override
    def step(self) -> Vector3:
        measured, state = self._measurement, self._state
        depth = measured.tip_depth_m
        if measured.position_m[2] < -self._slack_m:
            # From the highest possible plate height on, a tool with a faulty sensor may press on the plate.
            self._monitor.free()
        if measured.filtered_force_z_N < -self._contact_N:
            state.explore_start = state.tick
            self.over = True
            self.touched = depth < self._depth_m - self._tolerance_m - self._slack_m
            if self.touched:
                state.surface_m = depth
                state.event("contact", f"surface at {depth * 1e3:.3f} mm below the nominal plate")
        elif depth > self._monitor.deepest_plate_m:
            state.explore_start = state.tick
            self.over = True
        if self.over and not self.touched:
            # The surface was never touched, so its height is known only from the setup of the plate.
            state.slack_m = self._slack_m
            state.event("no plate contact")
        return self._controller.velocity_m_s(self._motion.reference_m, self._target_m, measured.force_N)
