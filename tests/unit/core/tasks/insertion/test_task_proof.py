"""Contact that has to be proved: trials with an honest force sensor, and with sensors that lie in every phase."""

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from math import sqrt

import numpy as np
import pytest

from palpate.core.control_loop import run_trial
from palpate.core.ports import PERIOD_S
from palpate.core.ports.values import JointSample, WrenchSample
from palpate.core.tasks.contact.sign_of_life import SignOfLife
from palpate.core.tasks.insertion import InsertionTask
from palpate.core.trial import Outcome, Phase, TaskConfig, TrialReport, TrialSetup, TripReason
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


@pytest.mark.parametrize(("late_ticks", "lifts"), [(0, False), (3, False), (8, True)])
def test_a_tip_that_slides_is_lifted_only_where_the_force_follows_its_heave_too_late(
    late_ticks: int, lifts: bool
) -> None:
    past: deque[np.ndarray] = deque(maxlen=late_ticks + 1)

    def late(held: np.ndarray, true: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        past.append(true + NOISE * rng.standard_normal(6))
        return past[0]

    trial = Trial(FakeWorld(HOLE), late, Phase.SETTLE)
    assert trial.report.outcome is Outcome.INSERTED
    assert any(detail.startswith("lift: ") for detail in trial.details("proof")) == lifts


@pytest.mark.parametrize(("ticks", "heaves"), [(1, True), (3, False)])
def test_a_tip_does_not_heave_where_the_encoders_are_far_behind_the_force(
    ticks: int, heaves: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a bus of 47 Hz it seemed to sink with every heave: place and force were not of the same time."""
    world, heaved = FakeWorld(HOLE), SignOfLife.heave_m_s
    measured, places, speeds = world.encoder._measured, deque[JointSample](maxlen=ticks + 1), list[float]()

    def behind(now_ns: int, sequence: int) -> JointSample:
        places.append(measured(now_ns, sequence))
        return replace(places[0], sequence=sequence)

    def noted(life: SignOfLife) -> float:
        speeds.append(heaved(life))
        return speeds[-1]

    monkeypatch.setattr(world.encoder, "_measured", behind)
    monkeypatch.setattr(SignOfLife, "heave_m_s", noted)
    assert Trial(world).report.outcome is Outcome.INSERTED
    assert bool(speeds) == heaves


def test_a_peg_that_drops_straight_in_finds_a_wall_and_the_floor() -> None:
    x, y = SETUP.start_m
    trial = Trial(FakeWorld(Pit(x + 1e-4, y)))
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.report.exploration_time_s == 0.0
    assert [detail.split(":")[0] for detail in trial.details("proof")] == ["wall", "floor"]


def test_a_hole_deeper_than_asked_is_proved_by_a_second_push() -> None:
    trial = Trial(FakeWorld(replace(HOLE, depth_m=0.02)))
    assert trial.report.outcome is Outcome.INSERTED
    assert [detail.split(":")[0] for detail in trial.details("proof")][-2:] == ["wall", "wall"]


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


def test_no_plate_is_a_doubt_and_not_a_search() -> None:
    trial = Trial(FakeWorld(height_m=np.inf))
    assert trial.report.outcome is Outcome.UNPROVED
    assert trial.details("doubt")[0].startswith(TripReason.PLATE_NOT_FELT.name)


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


@pytest.mark.parametrize("phase", [Phase.APPROACH, Phase.EXPLORE, Phase.INSERT, Phase.PROVE])
def test_a_sensor_held_with_its_own_noise_is_doubted_in_every_phase(phase: Phase) -> None:
    trial = Trial(FakeWorld(HOLE), held(1.0), phase)
    assert trial.report.outcome is Outcome.UNPROVED
    (doubt,) = trial.details("doubt")
    reason = TripReason[doubt.split(":")[0]]
    assert trial.task.expectation.doubt is not None
    assert trial.task.expectation.doubt.reason is reason


def test_a_peg_stuck_in_the_hole_under_a_held_sensor_bends_the_gripper_little() -> None:
    trial = Trial(FakeWorld(FAR_AWAY, Pit(-0.6e-3, 0.6e-3)), held(1.0), Phase.EXPLORE)
    assert trial.report.outcome is Outcome.UNPROVED
    assert trial.peak_N < 60.0


@pytest.mark.parametrize(
    ("follows", "text"), [(True, "where the floor must be above"), (False, "bore no lift in time")]
)
def test_a_floor_that_bears_nothing_is_doubted(follows: bool, text: str) -> None:
    """A hole without a floor, under a sensor that shows some of one; the arm sinks past it, or stops on its way."""
    world = FakeWorld(replace(HOLE, depth_m=0.05))

    def lie(held: np.ndarray, true: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        if world.tip_m[2] < 9.7e-3:
            return true
        if not follows and world.tip_m[2] > 10.3e-3:
            world.arm._max_step_rad = 0.0
        return true - (0.0, 0.0, 2.0, 0.0, 0.0, 0.0)

    trial = Trial(world, lie, Phase.INSERT)
    assert trial.report.outcome is Outcome.UNPROVED
    (doubt,) = trial.details("doubt")
    assert doubt.startswith("FORCE_WITHOUT_SPRING")
    assert text in doubt


def test_without_proof_the_task_is_what_it_was() -> None:
    """What older logs and run folders mean: nothing is pushed, lifted or doubted."""
    task = build_task(FollowTorque())
    world = FakeWorld(HOLE)
    with world:
        report = run_trial(task, world.ports, SETUP)
    assert report.outcome is Outcome.INSERTED
    assert {event.name for event in report.events}.isdisjoint({"proof", "doubt"})


class Drifting:
    """An axial force that drifts from its first sample on, in N/s."""

    def __init__(self, rate_N_s: float) -> None:
        self._rate_N_s, self._samples = rate_N_s, 0

    def __call__(self, held: np.ndarray, true: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        self._samples += 1
        wrench = true + NOISE * rng.standard_normal(6)
        wrench[2] += self._rate_N_s * self._samples * PERIOD_S
        return wrench


@pytest.mark.parametrize("rate_N_s", [5.0, 15.0])
def test_a_peg_that_sinks_while_it_is_borne_is_doubted_though_friction_answers_like_a_wall(rate_N_s: float) -> None:
    world = FakeWorld(FAR_AWAY)
    world.friction = 0.4
    trial = Trial(world, Drifting(rate_N_s), Phase.EXPLORE)
    assert trial.report.outcome is Outcome.UNPROVED
    assert trial.peak_N < 30.0


class HeldAtTheTouch:
    """Holds its sample, with noise of its own, as soon as it shows just enough force to pass for contact."""

    def __init__(self) -> None:
        self._rest_N: float | None = None
        self._held: np.ndarray | None = None

    def __call__(self, held: np.ndarray, true: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        self._rest_N = true[2] if self._rest_N is None else self._rest_N
        if self._held is None and abs(true[2] - self._rest_N) > 1.1:
            self._held = true
        return (true if self._held is None else self._held) + NOISE * rng.standard_normal(6)


def test_a_sensor_that_dies_at_the_touch_does_not_let_the_tool_press_on_for_good() -> None:
    trial = Trial(FakeWorld(FAR_AWAY), HeldAtTheTouch(), Phase.APPROACH)
    assert trial.report.outcome is Outcome.UNPROVED
    assert trial.peak_N < 30.0
