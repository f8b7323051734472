"""Contact that has to be proved: trials with an honest force sensor, and with sensors that lie in every phase."""

from collections.abc import Callable
from dataclasses import replace
from math import sqrt

import numpy as np
import pytest

from palpate.adapters.config import RunConfig, overlay, task_kind
from palpate.core.control_loop import run_trial
from palpate.core.ports.values import WrenchSample
from palpate.core.tasks.insertion import InsertionTask
from palpate.core.trial import Outcome, Phase, TaskConfig, TrialReport, TrialSetup
from tests.support.fault_trials import Case, run_cases, sensor_faults
from tests.unit.core.fake_world import FakeWorld, FollowTorque, Pit, build_task

HOLE = Pit(1.2e-3, -0.7e-3)
FAR_AWAY = Pit(0.03, 0.03)
SETUP = TrialSetup(0, 1, (-1.0e-3, 1.0e-3))
NOISE = np.array([0.1, 0.1, 0.1, 0.004, 0.004, 0.004])
Lie = Callable[[np.ndarray, np.ndarray, np.random.Generator], np.ndarray]


class Trial:
    """A trial whose sensor lies from some ticks into a phase on.

    Attributes:
        report: What the core says.
        task: The core.
        peak_N: The largest force that there really was.
        lied: Whether it came to that.
    """

    def __init__(
        self, world: FakeWorld, lie: Lie | None = None, phase: Phase = Phase.DONE, config: TaskConfig | None = None
    ) -> None:
        self.task: InsertionTask = build_task(FollowTorque(), config, proves=True)
        self.peak_N, self.lied = 0.0, False
        self._world, self._lie, self._phase = world, lie, phase
        self._held: np.ndarray | None = None
        self._ticks, self._rng = 0, np.random.default_rng(3)
        world.spoil = self._spoil
        with world:
            self.report: TrialReport = run_trial(self.task, world.ports, SETUP)

    def _spoil(self, sample: WrenchSample) -> WrenchSample:
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

    def details(self, name: str) -> list[str]:
        return [event.detail for event in self.report.events if event.name == name]


def held(share: float) -> Lie:
    return lambda held, true, rng: held + share * NOISE * rng.standard_normal(6)


def scaled(factor: float) -> Lie:
    return lambda held, true, rng: factor * (true + NOISE * rng.standard_normal(6))


def flipped(held: np.ndarray, true: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return -true + NOISE * rng.standard_normal(6)


def without_axial(held: np.ndarray, true: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    wrench = true + NOISE * rng.standard_normal(6)
    wrench[2] = held[2] + NOISE[2] * rng.standard_normal()
    return wrench


def swapped(held: np.ndarray, true: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return (true + NOISE * rng.standard_normal(6))[[1, 0, 2, 3, 4, 5]]


# An honest sensor.


def test_an_insertion_is_proved_by_a_wall_and_the_floor() -> None:
    trial = Trial(FakeWorld(HOLE))
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.report.depth_m == pytest.approx(0.010, abs=1e-4)
    kinds = [detail.split(":")[0] for detail in trial.details("proof")]
    assert kinds[-2:] == ["wall", "floor"]
    assert float(trial.details("proof")[-1].split()[1]) == pytest.approx(1.0, abs=0.15)
    assert trial.details("doubt") == []


@pytest.mark.parametrize("press_kgf", [0.4, 1.0])
def test_other_pressing_forces_are_proved_too(press_kgf: float) -> None:
    assert Trial(FakeWorld(HOLE), config=TaskConfig(press_kgf=press_kgf)).report.outcome is Outcome.INSERTED


def test_a_gripper_of_another_stiffness_is_doubted_and_named() -> None:
    trial = Trial(FakeWorld(HOLE), config=TaskConfig(press_kgf=0.5))
    assert trial.report.outcome is Outcome.INSERTED
    world = FakeWorld(HOLE)
    world.stiffness_N_per_m = 2.0e3
    soft = Trial(world)
    assert soft.report.outcome is Outcome.UNPROVED
    assert "control.axial_stiffness_N_per_mm" in soft.details("doubt")[0]


def test_a_noisy_touch_is_looked_at_longer_before_a_lift() -> None:
    """Judged after 29 ms, a noise of 0.3 N puts one touch of six outside the bounds."""
    rng, longer, lifts = np.random.default_rng(3), 0, 0

    def noisy(sample: WrenchSample) -> WrenchSample:
        x, y, z = sample.force_N
        return replace(sample, force_N=(x, y, z + 0.3 * rng.standard_normal()))

    for _ in range(20):
        world = FakeWorld(FAR_AWAY)
        world.stiffness_N_per_m *= 0.78
        world.spoil = noisy
        task = build_task(FollowTorque(), TaskConfig(ticks_per_action=4, time_limit_s=0.2), proves=True)
        with world:
            events = run_trial(task, world.ports, SETUP).events
        touched = next(event.tick for event in events if event.name == "contact")
        judged = next((event for event in events if event.name == "proof" and event.detail.startswith("first")), None)
        longer += judged is not None and judged.tick - touched > 8
        lifts += judged is None
    assert longer >= 2
    assert lifts == 0


# Sensors that lie.

_LIES: dict[str, tuple[Lie, float]] = {
    "held, quiet": (held(0.06), 60.0),
    "held, noise of its own": (held(1.0), 60.0),
    "scaled by 0.01": (scaled(0.01), 60.0),
    "scaled by 0.1": (scaled(0.1), 60.0),
    "flipped": (flipped, 60.0),
    "axial force dead": (without_axial, 60.0),
    "forces swapped": (swapped, 60.0),
}


@pytest.mark.parametrize("phase", [Phase.SETTLE, Phase.APPROACH, Phase.EXPLORE, Phase.INSERT, Phase.PROVE])
@pytest.mark.parametrize("name", _LIES)
def test_no_liar_passes_for_an_insertion_that_was_none(name: str, phase: Phase) -> None:
    lie, limit_N = _LIES[name]
    world = FakeWorld(HOLE)
    trial = Trial(world, lie, phase)
    assert trial.lied
    _, _, tip_z_m = world.tip_m
    if trial.report.outcome is Outcome.INSERTED:
        assert tip_z_m > 0.0098
    assert trial.peak_N < limit_N


@pytest.mark.parametrize(
    ("phase", "seed", "fault", "limit_N"),
    [
        pytest.param(
            "settle", 98708, "later by 0.2 s a second, new times", 15.0, id="the tip seems to leave the plate"
        ),
        pytest.param("insert", 98709, "of 1 s, sign flipped, fresh noise", 30.0, id="it leads the peg back out"),
    ],
)
def test_a_lie_that_bent_the_gripper_in_the_campaign_is_latched(
    phase: str, seed: int, fault: str, limit_N: float
) -> None:
    config = overlay(RunConfig(), task_kind("insertion").preset)
    [chosen] = [each for each in sensor_faults() if each.name.endswith(fault) and "encoder" not in each.name]
    [[run]] = run_cases(config, [Case(chosen, phase, seed)], "torque")
    assert run.latched
    assert run.peak_force_N < limit_N


def test_what_seems_a_hole_and_is_none_is_explored_although_the_plate_was_never_felt() -> None:
    """A sensor that is dead until the plate bears 5 N: the peg goes on from the approach to sink, and explores."""
    woken: list[bool] = []

    def dead_at_first(held: np.ndarray, true: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        woken.extend([True] if true[2] < -5.0 else [])
        return (true if woken else held) + NOISE * rng.standard_normal(6)

    trial = Trial(FakeWorld(HOLE), dead_at_first, Phase.APPROACH, TaskConfig(press_kgf=1.0))
    assert trial.details("false drop")
    assert trial.report.outcome is Outcome.INSERTED


def test_without_proof_the_task_is_what_it_was() -> None:
    """What older logs and run folders mean: nothing is pushed, lifted or doubted."""
    task = build_task(FollowTorque())
    world = FakeWorld(HOLE)
    with world:
        report = run_trial(task, world.ports, SETUP)
    assert report.outcome is Outcome.INSERTED
    assert {event.name for event in report.events}.isdisjoint({"proof", "doubt"})
