"""A task in a package of its own: press on the plate beside the hole, hold the force for a while, and say how well.

pip install examples/press_task
palpate run --task press --trials 3 --out runs/press
palpate replay runs/press
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from math import sqrt
from typing import Annotated, Any, ClassVar

from palpate.core.motion import ArmDescription, DampingControl, PositionControl, TipMotion
from palpate.core.ports import PERIOD_S, Range, Settings, Truth, Vector3
from palpate.core.tasks.contact import ContactProof, RunningPhase, TouchTask, TrialState
from palpate.core.trial import (
    N_PER_KGF,
    Fit,
    Measurement,
    Outcome,
    ReadyPose,
    TaskConfig,
    TaskKind,
    TaskParts,
    TrialReport,
    TrialSetup,
    Workspace,
    find_ready_pose,
    options_of,
)


@dataclass(frozen=True)
class PressOptions(Settings):
    """What `--task.options NAME VALUE` may set; each has a range and a default."""

    TABLE: ClassVar[str] = "task.options"

    aside_mm: Annotated[float, Range(0.0, 8.0)] = 6.0
    """Distance from the nominal goal, along x."""
    hold_s: Annotated[float, Range(0.1, 60.0)] = 2.0
    """Time for which the force is held."""


class PressPhase(Enum):
    """A task's phases are names of its own; they are in the log's events."""

    PRESS = "press"


class Press(RunningPhase):
    """Down, and on until the force was held long enough."""

    def __init__(
        self, task: TaskConfig, law: DampingControl, measurement: Measurement, motion: TipMotion, state: TrialState
    ) -> None:
        self._law, self._measurement, self._motion, self._state = law, measurement, motion, state
        self._press_N, self._limit_s = task.press_kgf * N_PER_KGF, task.time_limit_s
        self._hold_s, self.over = options_of(PressOptions, task).hold_s, False

    def enter(self) -> None:
        self._ticks, self._held, self._square_sum = 0, 0, 0.0

    def step(self) -> Vector3:
        reference_m, force_N = self._motion.reference_m, self._measurement.force_N
        self._ticks += 1
        error_N = -force_N[2] - self._press_N
        # The first contact counts from where most of the force is there.
        if self._held or error_N > -0.2 * self._press_N:
            self._held, self._square_sum = self._held + 1, self._square_sum + error_N * error_N
        if self._held * PERIOD_S >= self._hold_s:
            self._state.end(Outcome.DONE, f"held within {sqrt(self._square_sum / self._held):.3f} N RMS")
        elif self._ticks * PERIOD_S >= self._limit_s:
            self._state.end(Outcome.TIME_LIMIT, f"{self._limit_s:g} s")
        return 0.0, 0.0, self._law.velocity_m_s(reference_m, reference_m, force_N)[2]


class PressTask(TouchTask):
    """Lift, way to the start, tare and every limit are the base's."""

    def __init__(self, parts: TaskParts) -> None:
        task, control, state = parts.task, parts.control, TrialState()
        speed_m_s, pressing = task.travel_speed_mm_s * 1e-3, (0.0, 0.0, -task.press_kgf * N_PER_KGF)
        free = PositionControl(control.position_gain_per_s, speed_m_s, PERIOD_S)
        law = DampingControl(
            control.damping_N_s_per_m, pressing, speed_m_s, control.axial_stiffness_N_per_mm * 1e3, PERIOD_S
        )
        super().__init__(task, parts.measurement, parts.motion, free, state, ContactProof(task, control))
        self._press = Press(task, law, parts.measurement, parts.motion, state)

    def _follow(self) -> None:
        self._press.enter()
        self._enter(PressPhase.PRESS, self._press)


class PressKind(TaskKind):
    """What palpate asks of a kind of task; the entry point leads to the one object of this class."""

    preset: Mapping[str, Any] = {}
    asks_policy = False
    options = PressOptions

    def workspace(self, task: TaskConfig) -> Workspace:
        aside_mm = options_of(PressOptions, task).aside_mm
        return Workspace((aside_mm, 0.0), task.ready_height_mm, 2.0)

    def ready(self, arm: str | ArmDescription, task: TaskConfig) -> ReadyPose:
        return find_ready_pose(arm, task, self.workspace(task))

    def setup(self, task: TaskConfig, seed: int, trial: int) -> TrialSetup:
        return TrialSetup(trial, seed, (options_of(PressOptions, task).aside_mm * 1e-3, 0.0))

    def make(self, parts: TaskParts) -> PressTask:
        return PressTask(parts)

    def achieved(self, task: TaskConfig, report: TrialReport, truth: Truth, fit: Fit) -> bool:
        return report.outcome is Outcome.DONE and truth.peak_force_N < task.max_force_N


PRESS = PressKind()
