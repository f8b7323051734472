"""Contact verification in whole trials: with a sound force sensor, and with faulty ones in every phase."""

from dataclasses import replace
from itertools import count
from math import sqrt

import numpy as np
import pytest

from palpate.adapters.config import RunConfig, compose, configured, overlay, scenario, task_kind
from palpate.adapters.experiments import ChosenPolicy, Run, ready_pose, trial_setup
from palpate.adapters.experiments import build_task as build_trial_task
from palpate.adapters.experiments.planning import run_series
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.control_loop import run_trial
from palpate.core.ports import CONTROL_RATE_HZ
from palpate.core.trial import Outcome, Phase, TaskConfig, TrialSetup
from tests.support.fault_trials import Case, run_cases, sensor_faults
from tests.unit.core.fake_world import FakeWorld, FollowTorque, Pit, build_task

HOLE = Pit(1.2e-3, -0.7e-3)
SETUP = TrialSetup(0, 1, (-1.0e-3, 1.0e-3))
NOISE = np.array([0.1, 0.1, 0.1, 0.004, 0.004, 0.004])


class Trial:
    """A trial whose sensor lies from some ticks into a phase on."""

    def __init__(self, world, lie=None, phase=Phase.DONE, config=None):
        self.task = build_task(FollowTorque(), config)
        self.peak_N, self.lied = 0.0, False
        self._world, self._lie, self._phase = world, lie, phase
        self._held = None
        self._ticks, self._rng = 0, np.random.default_rng(3)
        world.spoil = self._spoil
        with world:
            self.report = run_trial(self.task, world.ports, SETUP)

    def _spoil(self, sample):
        x, y, z = self._world.force_N
        self.peak_N = max(self.peak_N, sqrt(x * x + y * y + z * z))
        true = np.array([*sample.force_N, *sample.torque_Nm])
        wrench = true + NOISE * self._rng.standard_normal(6)
        self._ticks += self.task.phase is self._phase
        if self._lie is not None and self._ticks > 5:
            self.lied = True
            if self._held is None:
                self._held = wrench
            wrench = self._lie(self._held, true, self._rng)
        a, b, c, d, e, f = wrench.tolist()
        return replace(sample, force_N=(a, b, c), torque_Nm=(d, e, f))

    def details(self, name):
        return [event.detail for event in self.report.events if event.name == name]


def held(share):
    return lambda held, true, rng: held + share * NOISE * rng.standard_normal(6)


def scaled(factor):
    return lambda held, true, rng: factor * (true + NOISE * rng.standard_normal(6))


def flipped(held, true, rng):
    return -true + NOISE * rng.standard_normal(6)


def without_axial(held, true, rng):
    wrench = true + NOISE * rng.standard_normal(6)
    wrench[2] = held[2] + NOISE[2] * rng.standard_normal()
    return wrench


def swapped(held, true, rng):
    return (true + NOISE * rng.standard_normal(6))[[1, 0, 2, 3, 4, 5]]


def drifting(rate_N_s):
    ticks = count()

    def lie(held, true, rng):
        wrench = true + NOISE * rng.standard_normal(6)
        wrench[2] += rate_N_s * next(ticks) / CONTROL_RATE_HZ
        return wrench

    return lie


# A sound sensor.


def test_wall_and_the_floor_verify_an_insertion():
    trial = Trial(FakeWorld(HOLE))
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.report.depth_m == pytest.approx(0.010, abs=1e-4)
    verified = trial.details("verified")
    assert verified[0].startswith("wall at ")
    assert "standard deviation" in verified[-1]
    assert float(verified[-1].split(": ")[1].split()[0]) == pytest.approx(5.0, abs=1.0)
    assert trial.details("mismatch") == []


def test_insertion_may_press_harder_than_the_search():
    trial = Trial(FakeWorld(HOLE), config=TaskConfig(press_kgf=0.4, insertion_press_kgf=1.0))
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.details("insertion press") == []
    assert trial.peak_N > 8.0


def test_gripper_of_another_stiffness_is_named_with_its_figures():
    world = FakeWorld(HOLE)
    world.stiffness_N_per_m = 2.0e3
    soft = Trial(world)
    assert soft.report.outcome is Outcome.CONTACT_MISMATCH
    [text] = soft.details("mismatch")
    assert text.startswith("CONTACT_MISMATCH")
    measured = float(text.split("along the axis ")[1].split(" ")[0])
    assert measured == pytest.approx(2.0, abs=0.3)
    assert "expected 3.25 to 7.50 N/mm" in text


@pytest.mark.parametrize(
    ("depth_mm", "outcome"), [(9.9, Outcome.INSERTED), (9.0, Outcome.WEDGED), (9.6, Outcome.WEDGED)]
)
def test_peg_that_rests_too_high_is_wedged(depth_mm, outcome):
    trial = Trial(FakeWorld(Pit(1.2e-3, -0.7e-3, depth_m=depth_mm * 1e-3)))
    assert trial.report.outcome is outcome


def test_no_floor_is_missed_that_a_shifted_zero_of_the_force_hides():
    trial = Trial(FakeWorld(Pit(1.2e-3, -0.7e-3, depth_m=0.02)))
    press_bends_m = 1e-3
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.report.depth_m > 0.0104 + press_bends_m


@pytest.mark.parametrize(("friction_N", "outcome"), [(0.0, Outcome.INSERTED), (4.0, Outcome.UNCERTAIN_DEPTH)])
def test_without_a_touch_only_a_floor_that_lets_go_makes_the_depth_certain(friction_N, outcome):
    """The peg goes straight into the hole: the plate's height is only known to half a millimetre."""
    x_m, y_m = SETUP.start_m
    hole = Pit(x_m, y_m, depth_m=9.9e-3, friction_N=friction_N, friction_below_m=9.0e-3)
    trial = Trial(FakeWorld(hole), config=TaskConfig(time_limit_s=1.0))
    assert trial.report.outcome is outcome
    assert trial.details("short")


@pytest.mark.parametrize("moving_mass_kg", [0.3, 1.8])
def test_heavy_tool_starts_and_ends_its_search(moving_mass_kg):
    """A check that began under a moving press and needed more at rest went on for ever with 1.5 kg."""
    config = overlay(scenario("blind"), {"cell": {"compliance": {"moving_mass_kg": moving_mass_kg}}})
    ready, chosen = ready_pose(config), ChosenPolicy("torque", config)
    with SimulatedRig(config, ready) as rig:
        rig.prepare(1)
        task = build_trial_task(config, ready, chosen.perception, chosen.on(rig))
        assert run_trial(task, rig.ports, trial_setup(config, 1)).outcome is Outcome.INSERTED


# Faulty sensors.

_LIES = {
    "held, quiet": held(0.06),
    "held, noise of its own": held(1.0),
    "scaled by 0.01": scaled(0.01),
    "scaled by 0.1": scaled(0.1),
    "flipped": flipped,
    "axial force dead": without_axial,
    "forces swapped": swapped,
}


@pytest.mark.parametrize(
    "phase",
    [
        *(pytest.param(phase, marks=pytest.mark.nightly) for phase in (Phase.SETTLE, Phase.APPROACH)),
        Phase.EXPLORE,
        Phase.INSERT,
    ],
)
@pytest.mark.parametrize("name", _LIES)
def test_no_faulty_sensor_passes_for_an_insertion_that_was_none(name, phase):
    world = FakeWorld(HOLE)
    trial = Trial(world, _LIES[name], phase)
    assert trial.lied
    _, _, tip_z_m = world.tip_m
    if trial.report.outcome is Outcome.INSERTED:
        assert tip_z_m > 0.0098
    assert trial.peak_N < 60.0


@pytest.mark.parametrize("phase", [Phase.APPROACH, Phase.EXPLORE])
def test_force_that_falls_while_the_tool_is_stationary_is_no_descent(phase, monkeypatch):
    # Noise across the axis hides nothing along it.
    monkeypatch.setitem(globals(), "NOISE", NOISE * [1.0, 20.0, 1.0, 1.0, 1.0, 1.0])
    trial = Trial(FakeWorld(Pit(0.03, 0.03)), drifting(5.0), phase)
    assert trial.report.outcome is Outcome.CONTACT_MISMATCH
    [text] = trial.details("mismatch")
    rate_N_s = float(text.partition("the force changes by ")[2].split()[0])
    assert rate_N_s == pytest.approx(5.0, abs=0.3)
    assert trial.peak_N < 35.0


@pytest.mark.parametrize(
    ("phase", "seed", "fault", "limit_N"),
    [
        pytest.param(
            "settle", 98708, "later by 0.2 s a second, new times", 15.0, id="the tip seems to leave the plate"
        ),
        pytest.param("insert", 98709, "of 1 s, sign flipped, fresh noise", 60.0, id="it leads the peg back out"),
    ],
)
def test_lie_that_bent_the_gripper_in_the_campaign_is_latched(phase, seed, fault, limit_N):
    config = overlay(RunConfig(), task_kind("insertion").preset)
    [chosen] = [each for each in sensor_faults() if each.name.endswith(fault) and "encoder" not in each.name]
    [[run]] = run_cases(config, [Case(chosen, phase, seed)], "torque")
    assert run.latched
    assert run.peak_force_N < limit_N


JOB = {
    "part": {
        "peg_mm": 46.8, "hole_mm": 46.824, "depth_mm": 12.0, "chamfer_mm": 0.5, "friction_max": 0.2,
        "depth_tolerance_mm": 0.2,
    },
    "tool": {
        "mass_kg": 1.25, "rigid_mass_kg": 0.05, "axial_N_per_mm": 8.0, "lateral_N_per_mm": 64.0,
        "tilt_Nm_per_rad": 80.0, "torsion_Nm_per_rad": 80.0,
    },
    "arm": {"name": "ur3"},
    "place": {"position_uncertainty_mm": 0.6, "tilt_uncertainty_mrad": 4.8},
    "cell": {
        "peg": {"friction": 0.11}, "tilt_mrad": 4.8,
        "sensor": {"force_noise_N": 0.36, "torque_noise_Nm": 0.0144},
    },
}  # fmt: skip


def test_drift_that_starts_in_a_tight_hole_is_found_before_the_limit_is_exceeded_by_far():
    rough = JOB | {"part": JOB["part"] | {"friction_max": 0.6}, "cell": JOB["cell"] | {"peg": {"friction": 0.6}}}
    config = compose("job", job=rough, task="insertion")
    [drift] = [each for each in sensor_faults() if each.name == "Fz drifts by 7 N/s"]
    [[run]] = run_cases(config, [Case(drift, "insert", 1)], "oracle")
    assert run.latched
    assert run.peak_force_N < 40.0


@pytest.mark.nightly
def test_peg_on_the_floor_comes_up_and_counts():
    config = compose("job", "belief", job=JOB, task="insertion")
    outcomes = [(each.outcome, each.success) for each in run_series(config, "", range(4))]
    assert outcomes == [("inserted", True)] * 4


@pytest.mark.parametrize(
    ("hole_mm", "axial", "lateral", "lag_ms", "policy", "trial"),
    [
        pytest.param(12.018, 20.0, 100.0, 45.0, "spiral-5", 37, id="contact is lost in one step"),
        pytest.param(12.58, 10.0, 83.0, 10.0, "spiral-5", 2, id="the peg comes free while it is pressed harder"),
        pytest.param(12.6, 10.0, 83.0, 45.0, "torque", 6, id="the nearest wall is on the other side"),
        pytest.param(12.6, 10.0, 83.0, 45.0, "torque", 0, id="the peg moves to another wall"),
    ],
)
def test_wall_verifies_the_sensor_if_the_budget_is_spent(hole_mm, axial, lateral, lag_ms, policy, trial):
    tool = {"axial_N_per_mm": axial, "lateral_N_per_mm": lateral}
    flags = {"part": {"hole_mm": hole_mm}, "tool": tool, "limits": {"lag_ms": lag_ms}}
    config = configured("examples/jobs/dowel-12-h7.toml", arm="ur10e", flags=flags)
    assert Run(config).trial(policy, trial).report.outcome is Outcome.INSERTED
