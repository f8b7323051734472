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
TICK_NS = 10**9 // CONTROL_RATE_HZ
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


def still(*_: object) -> float:
    return 0.0


def pushed(
    force_N: Force,
    lie: Force | None = None,
    *,
    trial: int = 0,
    noise: float = 0.0,
    speed_m_s: float = SPEED_M_S,
    late_ticks: tuple[int, int] = (0, 0),
    each_ticks: tuple[int, int] = (1, 1),
    heaves: float = 1.0,
    step_m: float = 0.0,
    tared_N: float = NOISE[2],
    ticks: int = TICKS,
) -> tuple[float, list[str]]:
    """Furthest way, in N of bend, since the lie began, or from the start without one; and what happened.

    Args:
        late_ticks: By so much forces and places come late.
        each_ticks: In every so many-th tick there is a new force, and a new place.
        heaves: The share that the arm makes of what it is told along the tool.
        step_m: Of an encoder, along the tool.
        tared_N: Noise of the axial force, as the tare showed it; that of an honest one, too.
    """
    state, chance, control = TrialState(), random.Random(trial), ControlConfig()
    measured = SimpleNamespace(axial_N_per_m=control.axial_stiffness_N_per_mm * 1e3)
    state.begin(TrialSetup(trial, 7, (0.0, 0.0)))
    state.noise = (*NOISE[:2], tared_N, *NOISE[3:])
    answered = AnsweredForce(state, measured, control, 0.02, MOST_N, MASS_KG, step_m / 12**0.5)  # type: ignore[arg-type]
    answered.begin()
    heights_m, felt_N, way_m, furthest_m = [0.0] * 4, list[float](), 0.0, 0.0
    places_m, (force_late, late), (force_each, each) = list[float](), late_ticks, each_ticks
    for state.tick in range(ticks):
        lies = lie is not None and state.tick >= LIES
        if state.tick == LIES and lie is not None:
            way_m = furthest_m = 0.0
        # A command shows in the encoders two ticks later.
        shown_m = heights_m[:-1]
        deviation = (noise if lies else 0.0) or tared_N
        axial_N = (lie if lies and lie is not None else force_N)(shown_m, felt_N) + chance.gauss(0.0, deviation)
        felt_N.append(axial_N)
        places_m.append(round(shown_m[-1] / step_m) * step_m if step_m else shown_m[-1])
        felt = max(state.tick - force_late, 0) // force_each * force_each
        shown = max(state.tick - late, 0) // each * each
        measured.force_N = 0.0, 0.0, felt_N[felt]
        measured.position_m = 0.0, 0.0, places_m[shown]
        wrench = WrenchSample(measured.force_N, (0.0, 0.0, 0.0), felt * TICK_NS, 0, felt)
        state.snapshot = Snapshot(state.tick, 0, wrench, JointSample((0.0,), shown * TICK_NS, 0, shown))
        answered.watch()
        vx, _, vz = answered.velocity_m_s((speed_m_s, 0.0, 0.0))
        way_m += vx * PERIOD_S
        furthest_m = max(furthest_m, way_m)
        heights_m.append(heights_m[-1] + vz * PERIOD_S * heaves)
    return furthest_m * 40e3, [event.detail for event in state.report.events]


@pytest.mark.parametrize("trial", range(3))
@pytest.mark.parametrize("force_N", [inertia, spring, slipping])
def test_a_live_sensor_lets_the_tool_go_on(force_N: Force, trial: int) -> None:
    way_N, doubts = pushed(force_N, trial=trial)
    assert way_N > 0.8 * TICKS * SPEED_M_S * PERIOD_S * 40e3
    assert not doubts


@pytest.mark.parametrize(
    ("late_ticks", "each_ticks"),
    [
        pytest.param((0, 1), (1, 1), id="places late by a tick"),
        pytest.param((0, 4), (1, 1), id="places late by four"),
        pytest.param((3, 0), (1, 1), id="forces late by three"),
        pytest.param((0, 2), (1, 2), id="places late, and each second tick"),
        pytest.param((0, 0), (2, 1), id="forces each second tick"),
    ],
)
@pytest.mark.parametrize("force_N", [inertia, spring])
def test_a_live_sensor_is_believed_where_either_is_late_or_slower(
    force_N: Force, late_ticks: tuple[int, int], each_ticks: tuple[int, int]
) -> None:
    way_N, told = pushed(force_N, late_ticks=late_ticks, each_ticks=each_ticks)
    assert way_N > 0.3 * TICKS * SPEED_M_S * PERIOD_S * 40e3
    assert not told


@pytest.mark.parametrize("trial", range(3))
def test_a_live_sensor_is_believed_where_the_encoders_count_in_coarse_steps(trial: int) -> None:
    way_N, told = pushed(inertia, trial=trial, heaves=0.2, step_m=40e-6)
    assert way_N > 0.5 * TICKS * SPEED_M_S * PERIOD_S * 40e3
    assert not told


@pytest.mark.parametrize("trial", range(3))
def test_a_noisy_sensor_is_waited_for_as_long_as_its_answer_takes(trial: int) -> None:
    way_N, told = pushed(spring, trial=trial, tared_N=0.4, heaves=0.4, ticks=1000)
    assert way_N > 4.0 * MOST_N
    assert not told


def test_an_arm_that_does_not_heave_as_it_is_told_is_asked_for_scatter_instead() -> None:
    _, told = pushed(lambda _, felt_N: 1.0 if len(felt_N) % 6 < 3 else -1.0, heaves=0.0)
    assert told == ["the encoders show less of a heave than is commanded: scatter of the force counts instead"]
    way_N, told = pushed(inertia, still, heaves=0.0)
    assert way_N < 60.0
    assert "the force sensor is dead" in told[-1]


@pytest.mark.parametrize("trial", range(3))
@pytest.mark.parametrize(
    ("lie", "noise"),
    [
        pytest.param(lambda _, felt_N: felt_N[-140], 0.1, id="the last second again, with fresh noise"),
        pytest.param(lambda _, felt_N: 0.3 * felt_N[-140], 0.1, id="0.3 of it"),
        pytest.param(lambda _, felt_N: -felt_N[-140], 0.1, id="turned"),
        pytest.param(lambda _, felt_N: felt_N[-14], 0.1, id="the last 0.1 s again"),
        pytest.param(still, 0.3, id="three times its noise"),
        pytest.param(lambda heights_m, felt_N: 0.1 * inertia(heights_m, felt_N), 0.1, id="a tenth"),
    ],
)
def test_a_lie_with_noise_of_its_own_stops_it_and_is_doubted(lie: Force, noise: float, trial: int) -> None:
    way_N, doubts = pushed(inertia, lie, trial=trial, noise=noise)
    assert way_N < 60.0
    # A recording may fit now and then; the tool pushes no further for it, and is stopped again.
    assert all("does not answer the heave" in doubt for doubt in doubts)


@pytest.mark.parametrize("trial", [3, 8, 23])
def test_a_recording_that_fits_again_and_again_is_not_believed_once_it_has_come_again(trial: int) -> None:
    way_N, _ = pushed(spring, lambda _, felt_N: felt_N[-140], trial=trial, noise=0.1)
    assert way_N < 1.4 * MOST_N


@pytest.mark.parametrize("mass_kg", [0.14, 0.7])
def test_a_tool_of_another_mass_than_told_is_named(mass_kg: float) -> None:
    _, doubts = pushed(lambda heights_m, felt_N: inertia(heights_m, felt_N, mass_kg))
    carried_kg = float(doubts[-1].split(" kg by its inertia")[0].split("it carries some ")[1])
    assert carried_kg == pytest.approx(mass_kg, rel=0.2)
    assert "task.options.tool_kg = 0.35 is wrong" in doubts[-1]


def test_a_tool_that_stands_is_asked_for_nothing() -> None:
    assert pushed(still, speed_m_s=0.0) == (0.0, [])


def test_each_trial_heaves_in_its_own_way_and_in_the_same_again() -> None:
    ways = [pushed(inertia, lambda _, felt_N: felt_N[-140], trial=trial)[0] for trial in (0, 0, 1)]
    assert ways[0] == ways[1] != ways[2]
