"""Whatever happens: commands stay finite and within limits, a trip leads only back, and equal snapshots give equal
results.
"""

from dataclasses import replace
from functools import cache
from math import isfinite, nan

from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.core.motion import Kinematics, arm_named
from palpate.core.ports.values import (
    AppliedCommand,
    CommandReason,
    JointCommand,
    JointSample,
    Snapshot,
    Validity,
    WrenchSample,
)
from palpate.core.supervision import SupervisionConfig
from palpate.core.trial import ExplorationArea, PhaseConstraints
from tests.unit.core.fake_world import TOOL, ready_pose
from tests.unit.core.supervision.bench import BIAS, supervisor

HOME, _ = ready_pose()
FREE = PhaseConstraints(contact=False)
ARM = Kinematics(arm_named("zebra-zero"), TOOL)
LOWER, UPPER = tuple(ARM.lower_rad.tolist()), tuple(ARM.upper_rad.tolist())
TARED = PhaseConstraints(contact=True, bias=BIAS)
EXPECTATIONS = {
    "untared": PhaseConstraints(contact=True),
    "untared, free": FREE,
    "free": PhaseConstraints(contact=False, bias=BIAS),
    "exploring": replace(TARED, area=ExplorationArea((0.0, 0.0), 3.5e-3)),
}
KINDS = (
    *("nothing",) * 6, *EXPECTATIONS, "force", "torque", "measured", "asked", "asked", "applied", "limited", "nonsense",
    "stopped", "invalid wrench", "invalid joints", "repeated", "source time", "late", "tip",
)  # fmt: skip
happenings = st.tuples(
    st.sampled_from(KINDS), st.one_of(st.floats(-1e-2, 1e-2), st.floats(-20, 20), st.floats(-1e300, 1e300))
)


def spoiled(values, number, by):
    return tuple(v + by * (i == number % len(values)) for i, v in enumerate(values))


def tick_of(number, now, kind, value):
    """The arm creeps and presses a little; one thing happens."""

    def by(*kinds):
        return value if kind in kinds else 0.0

    q = tuple(h + 1e-3 * number for h in HOME)
    f, t = spoiled(BIAS[:3], number, by("force")), spoiled(BIAS[3:], number, by("torque"))
    sequence = number - (kind == "repeated")
    taken = now - (round(min(max(value, -20), 20) * 1e9) if kind == "source time" else 0)
    wrench = WrenchSample(
        (f[0], f[1], f[2]), (t[0], t[1], t[2]), taken, now, sequence,
        Validity.STALE if kind == "invalid wrench" else Validity.VALID,
    )  # fmt: skip
    bad = kind == "invalid joints" and number
    measured = (nan,) * 6 if bad else spoiled(q, number, by("measured"))
    joints = JointSample(measured, taken, now, sequence, Validity.INVALID if bad else Validity.VALID)
    reason = {"limited": CommandReason.VELOCITY_LIMIT, "nonsense": CommandReason.POSITION_LIMIT}.get(
        kind, CommandReason.STOPPED if kind == "stopped" else CommandReason.AS_REQUESTED
    )
    done = (nan,) * 6 if kind == "nonsense" else spoiled(q, number, by("applied", "limited", "stopped"))
    x, y, z = spoiled((1e-3, 1e-3, 1e-3), number, by("tip"))
    return (
        Snapshot(number, now, wrench, joints, AppliedCommand(done, reason) if number else None),
        JointCommand(spoiled(tuple(h + 1e-3 * (number + 1) for h in HOME), number, by("asked"))),
        EXPECTATIONS.get(kind, TARED),
        None if kind == "nothing" else (x, y, z),
    )


@st.composite
def streams(draw):
    ticks = []
    now = 0
    for number, (kind, value) in enumerate(draw(st.lists(happenings, min_size=1, max_size=25))):
        now += 10**9 if kind == "late" else 7_142_857
        ticks.append(tick_of(number, now, kind, value))
    return ticks


configs = st.sampled_from([SupervisionConfig(), SupervisionConfig(on_trip="hold", weakened=("on_trip",))])


@cache
def reused(config):
    """One supervisor for all examples: whatever went before must not matter."""
    return supervisor(config)


def begun(config):
    made = reused(config)
    if made.trip is not None:
        made.latch.acknowledge("a person", "it was a test")
    made.begin()
    return made


@settings(max_examples=300)
@given(streams(), configs)
def test_every_command_is_finite_and_within_the_joint_limits(ticks, config):
    guard = begun(config)
    latched = None
    for tick in ticks:
        done = guard.check(*tick)
        q = done.command.position_rad
        assert isfinite(sum(q))
        assert all(low <= value <= high for low, value, high in zip(LOWER, q, UPPER, strict=True))
        assert (done.command_override is None) == (q == tick[1].position_rad and guard.trip is None)
        assert latched is None or guard.trip is latched
        latched = guard.trip
        assert done.command_override is None or done.command_override.trip is latched
        assert done.command_override is None or done.command_override.command_rad == q


within_limits = st.tuples(*(st.floats(low, high) for low, high in zip(LOWER, UPPER, strict=True)))


def along(start_rad):
    """How far back along the tool axis of a pose other poses are, in m."""
    ARM.update(start_rad)
    origin, axis = ARM.tip_position_m.copy(), ARM.tip_rotation[:, 2].copy()

    def back_m(q):
        ARM.update(q)
        return float((origin - ARM.tip_position_m) @ axis)

    return back_m


@settings(max_examples=60)
@given(
    start=st.one_of(st.tuples(*(st.floats(q - 0.2, q + 0.2) for q in HOME)), within_limits),
    shares=st.lists(st.one_of(st.just(1.0), st.floats(0.0, 1.0)), min_size=1, max_size=30),
    stop_at=st.one_of(st.none(), st.integers(1, 60)),
    config=configs,
)
def test_after_a_trip_no_command_advances_the_tip(start, shares, stop_at, config):
    """From anywhere, also near limits and singularities, and with an arm that follows as far as it likes."""
    guard, back_m = begun(config), along(start)
    command, applied, way, ticks = JointCommand(start), None, 0.0, 0
    held = start
    while ticks == 0 or guard.retracting or ticks < 20:
        now = ticks * 7_142_857
        wrench = WrenchSample((0.0, 0.0, -50.0), (0.0,) * 3, now, now, ticks, Validity.SATURATED)
        done = guard.check(Snapshot(ticks, now, wrench, JointSample(start, now, now, ticks), applied), command, FREE)
        requested = done.command.position_rad
        assert back_m(requested) >= way - 1e-9
        share = shares[ticks % len(shares)]
        reason = CommandReason.AS_REQUESTED if share == 1.0 else CommandReason.VELOCITY_LIMIT
        if share == 1.0:
            held = requested
        else:
            held = tuple(h + share * (a - h) for h, a in zip(held, requested, strict=True))
        if ticks == stop_at:
            reason = CommandReason.STOPPED
        applied, way = AppliedCommand(held, reason), back_m(held)
        ticks += 1
        assert ticks <= 2 * 105 + 20
    assert guard.trip is not None
