"""A way on which something may be met anywhere: the tool heaves, and the force has to follow."""

from __future__ import annotations

from math import hypot
from typing import ClassVar, Final

from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, Vector3
from palpate.core.tasks.contact.proof import ContactProof
from palpate.core.tasks.contact.sign_of_life import SignOfLife
from palpate.core.tasks.contact.trial_state import TrialState
from palpate.core.trial import ControlConfig, Measurement, Trip, TripReason

_UNFELT_N: Final = 25.0
"""What the gripper's springs may come to, at most, from one sign of life of the force sensor to the next."""
_LONGEST_TICKS: Final = CONTROL_RATE_HZ
"""On the spot; a noise of 0.3 N hides the inertia of 0.3 kg for so long once in a thousand times."""


class FeltWay:
    """Adds a heave to the way, and stops it where the force does not follow.

    It follows by the spring of a tool that is borne, and by the inertia of one that is not.

    Args:
        swing_N: Force that comes and goes with the heave of a tool that is borne.
        borne_N: One that shows more has to follow by the spring.
        speed_m_s: The heave is no faster.

    Attributes:
        COUNTS: What is a sign of life.
    """

    COUNTS: ClassVar = "a force that follows the commands"

    def __init__(
        self,
        state: TrialState,
        measurement: Measurement,
        proof: ContactProof,
        control: ControlConfig,
        swing_N: float,
        speed_m_s: float,
        borne_N: float,
    ) -> None:
        self._state, self._measured, self._proof = state, measurement, proof
        axial_N_per_m = control.axial_stiffness_N_per_mm * 1e3
        self._across = control.lateral_stiffness_N_per_mm / control.axial_stiffness_N_per_mm
        free_way_m = _UNFELT_N / axial_N_per_m
        self._life = SignOfLife(axial_N_per_m, swing_N, speed_m_s, free_way_m=free_way_m, in_air=True, borne_N=borne_N)

    def begin(self) -> None:
        """A trial begins."""
        self._life.begin()
        self._way_m = self._heaved_m = 0.0
        self._waited_ticks: int

    @property
    def waits(self) -> bool:
        """Whether the tool stays where it is until there is a sign of life."""
        return self._life.due

    def watch(self) -> None:
        """A tick of the trial; only those of the way count, and are watched as it heaves."""

    def velocity_m_s(self, velocity_m_s: Vector3) -> Vector3:
        """The velocity, (3,), task frame, for this tick, of a tool that goes on with this one, or waits with none."""
        x, y, z = velocity_m_s
        if self.waits:
            if not self._waited_ticks:
                self._life.resume()
            if self._waited_ticks == _LONGEST_TICKS:
                self._state.doubt(self._no_life())
            self._waited_ticks += 1
        else:
            self._waited_ticks = 0
            self._way_m += (hypot(x, y) * self._across + abs(z)) * PERIOD_S
        along_m_s = self._life.heave_m_s()
        self._life.watch(self._measured.force_N[2], self._proof.new, (self._way_m, 0.0, self._heaved_m))
        self._heaved_m += along_m_s * PERIOD_S
        return x, y, z + along_m_s

    def _no_life(self) -> Trip:
        text = (
            "the force does not follow the tool as it heaves: the force sensor is dead, or the tool too light for its"
            " inertia to be seen in the noise"
        )
        return Trip(TripReason.FORCE_WITHOUT_SPRING, self._state.tick, text)
