"""Verdicts of the response on simulated springs and sensors."""

from dataclasses import dataclass

import numpy as np
import pytest

from palpate.core.job import Spring
from palpate.core.ports import PERIOD_S
from palpate.core.tasks.contact import Dither, Response

STIFFNESS, DAMPING_S, RIGID_KG, PRESS_N = 5e3, 0.011, 0.05, 4.9
AMPLITUDE_M = 0.3 * PRESS_N / STIFFNESS


@dataclass
class Pressed:
    """A flange that dithers over a tip that does not move, and what the sensor shows of it."""

    sensor: object = lambda force, rng: force
    noise_N: float = 0.1
    step_m: float = 0.0
    late_ticks: int = 0
    amplitude_m: float = AMPLITUDE_M
    lag: int | None = None
    seed: int = 1
    ticks: int = 200

    def run(self):
        rng, dither = np.random.default_rng(self.seed), Dither(self.amplitude_m, 0.1)
        dither.begin(np.random.default_rng(self.seed + 1000))
        z = PRESS_N / STIFFNESS + np.cumsum([dither.velocity_m_s() * PERIOD_S for _ in range(self.ticks)])
        v, a = np.gradient(z, PERIOD_S), np.gradient(np.gradient(z, PERIOD_S), PERIOD_S)
        force = self.sensor(-STIFFNESS * (z + DAMPING_S * v) - RIGID_KG * a, rng)
        force = np.concatenate((np.full(self.late_ticks, force[0]), force))[: self.ticks]
        force, seen = (
            force + self.noise_N * rng.standard_normal(self.ticks),
            z + self.step_m * rng.standard_normal(self.ticks),
        )
        response = Response(Spring(STIFFNESS, DAMPING_S, RIGID_KG, 0.65, 1.5))
        response.begin(self.noise_N, self.step_m, max(self.amplitude_m, AMPLITUDE_M) * STIFFNESS, self.lag)
        verdicts = []
        for tick, (place_m, force_N) in enumerate(zip(seen.tolist(), force.tolist(), strict=True)):
            time_ns = round(tick * PERIOD_S * 1e9)
            response.add_place(time_ns, place_m)
            response.add_force(time_ns, force_N)
            verdicts.append("verified" if response.verified else "contradicted" if response.contradicted else "unknown")
        return response, verdicts


def share_of(verdict, sensor=lambda force, rng: force, **others):
    """Share of windows with this verdict, over trials."""
    runs = [Pressed(sensor, seed=seed, **others).run()[1][60:] for seed in range(8)]
    return float(np.mean([each == verdict for run in runs for each in run]))


@pytest.mark.parametrize("noise_N", [0.0, 0.1, 0.3])
def test_sound_sensor_is_verified(noise_N):
    assert share_of("verified", noise_N=noise_N) > 0.97
    assert share_of("contradicted", noise_N=noise_N) < 0.002


@pytest.mark.parametrize(
    "sensor",
    [
        pytest.param(lambda force, rng: np.full(len(force), force[0]), id="dead"),
        pytest.param(lambda force, rng: 0.5 * force, id="half"),
        pytest.param(lambda force, rng: 0.1 * force, id="a tenth"),
        pytest.param(lambda force, rng: 2.0 * force, id="double"),
        pytest.param(lambda force, rng: -force, id="inverted"),
    ],
)
def test_faulty_sensor_is_hardly_ever_verified(sensor):
    assert share_of("verified", sensor, lag=0) < 0.001
    assert share_of("contradicted", sensor, lag=0) > 0.5


@pytest.mark.parametrize("late_ticks", [0, 1, 2, 4])
def test_lag_of_the_force_is_found_and_kept(late_ticks):
    response, verdicts = Pressed(late_ticks=late_ticks, noise_N=0.05).run()
    assert response.lag == late_ticks
    assert verdicts[-1] == "verified"


def test_force_that_falls_behind_its_lag_is_no_longer_verified():
    assert share_of("verified", late_ticks=4, lag=0) < 0.05


def test_without_motion_nothing_is_known():
    response, verdicts = Pressed(amplitude_m=0.0).run()
    assert set(verdicts) == {"unknown"}
    assert not response.verified_since_restart()


def test_coarse_encoders_take_more_samples_and_do_not_lower_the_stiffness():
    fine, coarse = Pressed().run()[0], Pressed(step_m=4e-5).run()[0]
    assert coarse.window > fine.window
    measured = [Pressed(step_m=4e-5, seed=seed).run()[0].share for seed in range(20)]
    assert np.mean([each for each in measured if each is not None]) == pytest.approx(1.0, abs=0.12)


def test_noisy_sensor_asks_for_a_larger_dither():
    spring = Spring(STIFFNESS, DAMPING_S, RIGID_KG, 0.65, 1.5)
    assert spring.least_dither_N(0.3, 0.0) == pytest.approx(3.0 * spring.least_dither_N(0.1, 0.0))
    assert spring.least_dither_N(0.1, 1e-4) > 5.0 * spring.least_dither_N(0.1, 0.0)


def test_samples_before_a_restart_do_not_count():
    response, _ = Pressed(ticks=80).run()
    assert response.verified_since_restart()
    response.restart()
    assert not response.verified
    assert not response.verified_since_restart()


def places(amplitude_m, speed_m_s, seed=1, ticks=600):
    dither = Dither(amplitude_m, speed_m_s)
    dither.begin(np.random.default_rng(seed))
    return np.cumsum([dither.velocity_m_s() * PERIOD_S for _ in range(ticks)])


@pytest.mark.parametrize(("amplitude_m", "speed_m_s"), [(3e-4, 0.1), (3e-4, 0.02), (3e-4, 0.005), (1e-5, 0.02)])
def test_it_stays_within_amplitude_and_speed(amplitude_m, speed_m_s):
    moved = places(amplitude_m, speed_m_s)
    assert np.abs(moved).max() <= amplitude_m * (1.0 + 1e-9)
    assert np.abs(np.diff(moved)).max() <= speed_m_s * PERIOD_S * (1.0 + 1e-9)
