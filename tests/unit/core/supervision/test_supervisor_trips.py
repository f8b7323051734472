"""Every reason to trip: at the first tick at which it should, and not just below the limit."""

from dataclasses import dataclass, field, replace
from math import nan
from typing import Any

import pytest

from palpate.core.ports.values import Validity, WrenchKind
from palpate.core.supervision.config import SupervisionConfig
from palpate.core.supervision.watches import WorkspaceWatch
from palpate.core.trial import ExplorationArea, TripReason, Workspace
from tests.unit.core.supervision.bench import FREE, TOUCHING, UNTARED, Bench

MS = 1_000_000
EXPLORING = replace(TOUCHING, area=ExplorationArea((1e-3, 0.0), 3.5e-3))


@dataclass
class Case:
    """Good is let pass for ever, bad trips at once."""

    reason: TripReason
    good: dict[str, Any]
    bad: dict[str, Any]
    words: str
    before: dict[str, Any] = field(default_factory=dict)


def offset(joint: int, rad: float) -> dict[str, Any]:
    home = Bench().home_rad
    return {"measured_rad": tuple(q + rad * (i == joint) for i, q in enumerate(home))}


CASES = {
    "force": Case(
        TripReason.FORCE_LIMIT, {"force_N": (0, 0, -19.9)}, {"force_N": (12.0, 0, -16.1)},
        "force 20.08 N, limit 20 N",
    ),
    "force before taring": Case(
        TripReason.FORCE_LIMIT,
        {"force_N": (0, 0, -9.9), "expectation": UNTARED},
        {"force_N": (0, 0, -10.1), "expectation": UNTARED},
        "force 20.10 N more than at the start, before taring, limit 20 N",
        {"force_N": (0, 0, 10.0), "expectation": UNTARED},
    ),
    "torque": Case(
        TripReason.TORQUE_LIMIT, {"torque_Nm": (0, 4.9, 0)}, {"torque_Nm": (0, -5.1, 0)},
        "torque 5.10 N m, limit 5 N m",
    ),
    "torque before taring": Case(
        TripReason.TORQUE_LIMIT,
        {"torque_Nm": (4.9, 0, 0), "expectation": UNTARED},
        {"torque_Nm": (5.1, 0, 0), "expectation": UNTARED},
        "torque 5.10 N m more than at the start, before taring, limit 5 N m",
    ),
    "unexpected contact": Case(
        TripReason.UNEXPECTED_CONTACT,
        {"force_N": (0, 2.9, 0), "expectation": FREE},
        {"force_N": (0, 0, -3.2), "expectation": FREE},
        "force 3.20 N where nothing may be touched, limit 3 N",
    ),
    "force sample": Case(
        TripReason.SAMPLE_INVALID, {}, {"wrench": {"validity": Validity.SATURATED}},
        "the force sample is saturated",
    ),
    "joint sample": Case(
        TripReason.SAMPLE_INVALID, {}, {"joints": {"validity": Validity.INVALID, "position_rad": (nan,) * 6}},
        "the joint sample is invalid",
    ),
    "wrench in another frame": Case(
        TripReason.WRENCH_CONTRACT, {}, {"wrench": {"frame": "base"}},
        "wrenches are raw ones in the frame 'base', agreed were raw ones in 'sensor'",
    ),
    "wrench of another kind": Case(
        TripReason.WRENCH_CONTRACT, {}, {"wrench": {"kind": WrenchKind.TARED}},
        "wrenches are tared ones in the frame 'sensor', agreed were raw ones in 'sensor'",
    ),
    "old wrench": Case(
        TripReason.SAMPLE_STALE, {}, {"wrench": {"source_time_ns": -20 * MS}},
        "age of the force sample 55.7 ms, limit 50 ms",
    ),
    "old joints": Case(
        TripReason.SAMPLE_STALE, {}, {"joints": {"source_time_ns": -70 * MS}},
        "age of the joint sample 105.7 ms, limit 100 ms",
    ),
    "wrench of the future": Case(
        TripReason.SAMPLE_STALE, {}, {"wrench": {"source_time_ns": 100 * MS}},
        "age of the force sample -64.3 ms, limit 50 ms",
    ),
    "joint outside": Case(
        TripReason.JOINT_POSITION, {}, {"measured_rad": (0.0, 1.7051, -1.42, 0.0, 0.55, 0.0)},
        "joint 2 at 1.7051 rad, limit 1.7050 rad",
    ),
    "joint below": Case(
        TripReason.JOINT_POSITION, {}, {"measured_rad": (0.0, -1.0751, -1.42, 0.0, 0.55, 0.0)},
        "joint 2 at -1.0751 rad, limit -1.0750 rad",
    ),
    "arm astray": Case(
        TripReason.TRACKING_ERROR, offset(2, -9.9e-3), offset(2, -10.1e-3),
        "joint 3 is 10.10 mrad from its command, limit 10 mrad",
    ),
    "workspace, side": Case(
        TripReason.WORKSPACE, {"tip_m": (26.4e-3, -26.4e-3, 0)}, {"tip_m": (0, -26.6e-3, 0)},
        "tip at y = -26.60 mm in the task frame, the workspace ends at -26.5 mm",
    ),
    "workspace, other side": Case(
        TripReason.WORKSPACE, {"tip_m": (-26.4e-3, 26.4e-3, 0)}, {"tip_m": (26.6e-3, 0, 0)},
        "tip at x = 26.60 mm in the task frame, the workspace ends at 26.5 mm",
    ),
    "workspace, above": Case(
        TripReason.WORKSPACE, {"tip_m": (0, 0, -52.9e-3)}, {"tip_m": (0, 0, -53.1e-3)},
        "tip at z = -53.10 mm in the task frame, the workspace ends at -53 mm",
    ),
    "workspace, below": Case(
        TripReason.WORKSPACE, {"tip_m": (0, 0, 21.9e-3)}, {"tip_m": (0, 0, 22.1e-3)},
        "tip at z = 22.10 mm in the task frame, the workspace ends at 22 mm",
    ),
    "area": Case(
        TripReason.EXPLORATION_AREA,
        {"tip_m": (5.4e-3, -4.4e-3, 0), "expectation": EXPLORING},
        {"tip_m": (5.6e-3, 0, 0), "expectation": EXPLORING},
        "tip 4.60 mm from the centre of the exploration area, limit 4.5 mm",
    ),
    "area, across": Case(
        TripReason.EXPLORATION_AREA,
        {"tip_m": (1e-3, 4.4e-3, 0), "expectation": EXPLORING},
        {"tip_m": (1e-3, -4.6e-3, 0), "expectation": EXPLORING},
        "tip 4.60 mm from the centre of the exploration area, limit 4.5 mm",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_it_trips_at_the_first_bad_tick_and_not_before(name: str) -> None:
    case = CASES[name]
    bench = Bench(SupervisionConfig(max_force_N=20.0))
    bench.clean(1, **case.before)
    bench.clean(4, **case.good)
    done = bench.tick(**case.bad)
    trip = bench.tripped
    assert done.intervention is not None
    assert done.intervention.trip is trip
    assert done.intervention.reason is trip.reason is case.reason
    assert trip.tick == 5
    assert trip.text == case.words
    assert trip.sample == {"wrench": "force", "joints": "joint"}.get(next(iter(case.bad)), "")


def test_the_force_is_scaled_as_the_task_scales_it() -> None:
    bench = Bench(scale=(1.0, 1.0, 3.0, 1.0, 2.0, 1.0))
    bench.clean(5, force_N=(0, 0, -9.7), torque_Nm=(0, 2.4, 0))
    assert bench.trip(force_N=(0, 0, -9.7), torque_Nm=(0, 2.6, 0)).reason is TripReason.TORQUE_LIMIT
    bench = Bench(scale=(1.0, 1.0, 3.0, 1.0, 1.0, 1.0))
    bench.clean(5, force_N=(0, 0, -9.9))
    assert bench.trip(force_N=(0, 0, -10.1)).text.startswith("force 30.30 N")


@pytest.mark.parametrize(("good", "bad"), [((0.17, -0.3), (0.18, 0.0)), ((0.0, 0.3), (0.0, -0.36))])
def test_a_tool_that_leans_or_turns_too_far_trips(good: tuple[float, float], bad: tuple[float, float]) -> None:
    config = SupervisionConfig()
    watch = WorkspaceWatch(config, Workspace((6.5, 6.5), 3.0, 10.0, (10.0, 20.0)))
    assert watch.trip(1, (0.0, 0.0, 0.0), EXPLORING, good) is None
    trip = watch.trip(2, (0.0, 0.0, 0.0), EXPLORING, bad)
    assert trip is not None
    assert (trip.reason, "the workspace ends at 10.0 and 20.0" in trip.text) == (TripReason.WORKSPACE, True)
    flat = WorkspaceWatch(config, Workspace((6.5, 6.5), 3.0, 10.0))
    assert flat.trip(1, (0.0, 0.0, 0.0), EXPLORING, bad) is None
