"""A tool that pushes goes on while the force answers its heave, and stops soon after it does not."""

import random
from collections.abc import Callable
from types import SimpleNamespace

import pytest

from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, JointSample, Snapshot, WrenchSample
from palpate.core.tasks.contact import AnsweredForce, TrialState
from palpate.core.trial import ControlConfig, TrialSetup

NOISE = (0.1, 0.1, 0.1, 0.004, 0.004, 0.004)
SPEED_M_S = 9e-3
MOST_N = 26.0
MASS_KG = 0.35
TICKS = 600
LIES = 160

Force = Callable[[list[float], list[float]], float]
"""Axial force, by the heights of the flange and the forces felt until now."""


def inertia(heights_m: list[float], _: list[float], mass_kg: float = 0.3) -> float:
    before, last, now = heights_m[-3:]
    return -mass_kg * (now - 2.0 * last + before) * CONTROL_RATE_HZ**2


def spring(heights_m: list[float], _: list[float]) -> float:
    return -3.0 - 5e3 * (heights_m[-1] - heights_m[0])


def slipping(heights_m: list[float], felt_N: list[float]) -> float:
    last, now = heights_m[-2:]
    return 0.5 * inertia(heights_m, felt_N) - (0.6 if now > last else -0.6)


def pushed(
    force_N: Force, lie: Force | None = None, *, trial: int = 0, noise: float = 0.0, speed_m_s: float = SPEED_M_S
) -> tuple[float, list[str]]:
    """Furthest way, in N of bend, since the lie began, or from the start without one; and what was doubted."""
    state, measured, chance = TrialState(), SimpleNamespace(), random.Random(trial)
    state.begin(TrialSetup(trial, 7, (0.0, 0.0)))
    state.noise = NOISE
    answered = AnsweredForce(state, measured, ControlConfig(), 0.02, MOST_N, MASS_KG)  # type: ignore[arg-type]
    answered.begin()
    heights_m, felt_N, way_m, furthest_m = [0.0] * 4, list[float](), 0.0, 0.0
    for state.tick in range(TICKS):
        lies = lie is not None and state.tick >= LIES
        if state.tick == LIES and lie is not None:
            way_m = furthest_m = 0.0
        # A command shows in the encoders two ticks later.
        shown_m = heights_m[:-1]
        deviation = (noise if lies else 0.0) or NOISE[2]
        axial_N = (lie if lies and lie is not None else force_N)(shown_m, felt_N) + chance.gauss(0.0, deviation)
        felt_N.append(axial_N)
        measured.force_N = 0.0, 0.0, axial_N
        measured.tip_depth_m = shown_m[-1] + axial_N / 5e3
        wrench = WrenchSample(measured.force_N, (0.0, 0.0, 0.0), 0, 0, state.tick)
        state.snapshot = Snapshot(state.tick, 0, wrench, JointSample((0.0,), 0, 0, state.tick))
        answered.watch()
        vx, _, vz = answered.velocity_m_s((speed_m_s, 0.0, 0.0))
        way_m += vx * PERIOD_S
        furthest_m = max(furthest_m, way_m)
        heights_m.append(heights_m[-1] + vz * PERIOD_S)
    return furthest_m * 40e3, [event.detail for event in state.report.events]


@pytest.mark.parametrize("trial", range(3))
@pytest.mark.parametrize("force_N", [inertia, spring, slipping])
def test_a_live_sensor_lets_the_tool_go_on(force_N: Force, trial: int) -> None:
    way_N, doubts = pushed(force_N, trial=trial)
    assert way_N > 0.8 * TICKS * SPEED_M_S * PERIOD_S * 40e3
    assert not doubts


@pytest.mark.parametrize("trial", range(3))
@pytest.mark.parametrize(
    ("lie", "noise"),
    [
        pytest.param(lambda _, felt_N: felt_N[-140], 0.1, id="the last second again, with fresh noise"),
        pytest.param(lambda _, felt_N: 0.3 * felt_N[-140], 0.1, id="0.3 of it"),
        pytest.param(lambda _, felt_N: -felt_N[-140], 0.1, id="turned"),
        pytest.param(lambda _, felt_N: felt_N[-14], 0.1, id="the last 0.1 s again"),
        pytest.param(lambda *_: 0.0, 0.3, id="three times its noise"),
        pytest.param(lambda heights_m, felt_N: 0.1 * inertia(heights_m, felt_N), 0.1, id="a tenth"),
    ],
)
def test_a_lie_with_noise_of_its_own_stops_it_and_is_doubted(lie: Force, noise: float, trial: int) -> None:
    way_N, doubts = pushed(inertia, lie, trial=trial, noise=noise)
    assert way_N < 60.0
    # A recording may fit now and then; the tool pushes no further for it, and is stopped again.
    assert all("does not answer the heave" in doubt for doubt in doubts)


def test_a_tool_that_stands_is_asked_for_nothing() -> None:
    assert pushed(lambda *_: 0.0, speed_m_s=0.0) == (0.0, [])


def test_each_trial_heaves_in_its_own_way_and_in_the_same_again() -> None:
    ways = [pushed(inertia, lambda _, felt_N: felt_N[-140], trial=trial)[0] for trial in (0, 0, 1)]
    assert ways[0] == ways[1] != ways[2]
