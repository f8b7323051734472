"""A tool that pushes goes on while its sensor shows more than noise, and stops soon after it does not."""

import random
from collections.abc import Callable
from types import SimpleNamespace

import pytest

from palpate.core.ports import PERIOD_S, JointSample, Snapshot, WrenchSample
from palpate.core.tasks.contact import RestlessForce, TrialState
from palpate.core.trial import ControlConfig, TrialSetup

NOISE = (0.1, 0.1, 0.1, 0.004, 0.004, 0.004)
SPEED_M_S = 0.01
HEAVE_N_PER_M = 2e3
"""Inertia of 0.3 kg at 14 Hz."""


def pushed(force_N: Callable[[int, float], float], ticks: int = 300, gain: float = 1.0) -> tuple[float, list[str]]:
    """Way across of a tool whose sensor shows this axial force at a tick and height, and what was doubted."""
    state, measured, chance = TrialState(), SimpleNamespace(), random.Random(3)
    state.begin(TrialSetup(0, 0, (0.0, 0.0)))
    state.noise = NOISE
    restless = RestlessForce(state, measured, ControlConfig(), 0.02)  # type: ignore[arg-type]
    restless.begin()
    way_m = height_m = 0.0
    for state.tick in range(ticks):
        x, y, z, a, b, c = (chance.gauss(0.0, deviation) for deviation in NOISE)
        measured.force_N = gain * x, gain * y, gain * (z + force_N(state.tick, height_m))
        wrench = WrenchSample(measured.force_N, (gain * a, gain * b, gain * c), 0, 0, state.tick)
        state.snapshot = Snapshot(state.tick, 0, wrench, JointSample((0.0,), 0, 0, state.tick))
        restless.watch()
        vx, _, vz = restless.velocity_m_s((SPEED_M_S, 0.0, 0.0))
        way_m, height_m = way_m + vx * PERIOD_S, height_m + vz * PERIOD_S
    return way_m, [event.detail for event in state.report.events]


@pytest.mark.parametrize(
    "force_N",
    [
        lambda tick, _: -5.0 + 0.5 * (tick % 3),  # sliding
        lambda _, height_m: HEAVE_N_PER_M * height_m,  # in air
    ],
)
def test_a_live_sensor_lets_the_tool_go_on(force_N: Callable[[int, float], float]) -> None:
    way_m, doubts = pushed(force_N)
    assert way_m > 0.8 * 300 * SPEED_M_S * PERIOD_S
    assert not doubts


@pytest.mark.parametrize(
    ("force_N", "gain"),
    [
        (lambda tick, _: -4.9, 1.0),  # dead, with its noise
        (lambda tick, _: -1.0 * tick, 0.01),  # a hundredth of what there is: it grows, without the noise of a live one
    ],
)
def test_one_that_shows_no_sign_stops_it_and_is_doubted(force_N: Callable[[int, float], float], gain: float) -> None:
    way_m, doubts = pushed(force_N, gain=gain)
    assert way_m * 40e3 < 24.0
    assert doubts == [
        "CONTACT_MISMATCH: the force does not follow a tool that pushed without any: the force sensor is dead"
    ]
