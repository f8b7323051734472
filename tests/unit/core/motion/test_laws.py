"""Hybrid control: one law across, one along, and neither disturbs the other."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.motion.laws import ControlLaw, DampingControl, ForceControl, HybridControl, PositionControl
from palpate.core.ports.values import Vector3

PERIOD_S = 1.0 / 140
lengths = st.floats(-0.1, 0.1)
forces = st.floats(-50.0, 50.0)


class Recorder(ControlLaw):
    def __init__(self, answer: Vector3) -> None:
        self.answer = answer
        self.calls: list[tuple[Vector3, Vector3, Vector3]] = []
        self.resets = 0

    def velocity_m_s(self, reference_m: Vector3, target_m: Vector3, force_N: Vector3) -> Vector3:
        self.calls.append((reference_m, target_m, force_N))
        return self.answer

    def reset(self) -> None:
        self.resets += 1


def test_each_law_is_told_of_its_own_axes_and_answers_for_them() -> None:
    across, along = Recorder((1.0, 2.0, 30.0)), Recorder((10.0, 20.0, 3.0))
    law = HybridControl(across, along)
    assert law.velocity_m_s((0.1, 0.2, 0.3), (0.4, 0.5, 0.6), (7.0, 8.0, 9.0)) == (1.0, 2.0, 3.0)
    assert across.calls == [((0.1, 0.2, 0.0), (0.4, 0.5, 0.0), (7.0, 8.0, 0.0))]
    assert along.calls == [((0.0, 0.0, 0.3), (0.0, 0.0, 0.6), (0.0, 0.0, 9.0))]


def test_both_laws_forget() -> None:
    across, along = Recorder((0.0, 0.0, 0.0)), Recorder((0.0, 0.0, 0.0))
    HybridControl(across, along).reset()
    assert (across.resets, along.resets) == (1, 1)


def compliant_step() -> HybridControl:
    return HybridControl(
        PositionControl(70.0, 0.02, PERIOD_S),
        DampingControl(400.0, (0.0, 0.0, -5.0), 0.02, 5e3, PERIOD_S),
    )


@given(st.tuples(lengths, lengths, lengths), st.tuples(forces, forces, forces), forces)
def test_pressing_does_not_depend_on_the_step_nor_the_step_on_pressing(
    target: Vector3, force: Vector3, other_force: float
) -> None:
    law = compliant_step()
    vx, vy, vz = law.velocity_m_s((0.0, 0.0, 0.0), target, force)
    assert law.velocity_m_s((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, force[2]))[2] == vz
    assert law.velocity_m_s((0.0, 0.0, 0.0), target, (0.0, 0.0, other_force))[:2] == (vx, vy)


def test_the_speed_limit_of_one_does_not_slow_the_other() -> None:
    velocity = compliant_step().velocity_m_s((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert velocity == pytest.approx((0.02, 0.0, 0.0125))


def test_a_slide_along_a_wall_while_pressing_settles_on_every_axis() -> None:
    """The law of the insertion on a spring that is stiff across and soft along: both forces arrive."""
    across, along = 4e4, 5e3
    law = HybridControl(
        ForceControl(2.5e-4, 0.0, (0.0, 0.0, 0.0), 5e-3, across, PERIOD_S),
        DampingControl(400.0, (0.0, 0.0, -5.0), 0.02, along, PERIOD_S),
    )
    x, y, z = 2e-4, -1e-4, -1e-3
    for _ in range(700):
        force = (-across * x, -across * y, -along * max(z, 0.0))
        vx, vy, vz = law.velocity_m_s((x, y, z), (0.0, 0.0, 0.0), force)
        x, y, z = x + vx * PERIOD_S, y + vy * PERIOD_S, z + vz * PERIOD_S
    assert (-across * x, -across * y, -along * z) == pytest.approx((0.0, 0.0, -5.0), abs=1e-3)
