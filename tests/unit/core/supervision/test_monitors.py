"""Every reason to trip: at the first tick at which it should, and not just below the limit."""

from dataclasses import replace
from math import inf, nan, nextafter

import pytest

from palpate.core.ports.values import AppliedCommand, CommandReason, Validity, WrenchKind
from palpate.core.supervision.config import SupervisionConfig
from palpate.core.supervision.monitors import WorkspaceMonitor
from palpate.core.trial import ExplorationArea, TripReason, Workspace
from palpate.core.trial.constraints import PhaseConstraints
from tests.unit.core.supervision.bench import FREE, TOUCHING, UNTARED, Bench

MS = 1_000_000
EXPLORING = replace(TOUCHING, area=ExplorationArea((1e-3, 0.0), 3.5e-3))


def tip_at(x_mm, y_mm, z_mm):
    return {"tip_m": (x_mm * 1e-3, y_mm * 1e-3, z_mm * 1e-3)}


def second_joint_at(rad):
    return {"measured_rad": (0.0, rad, -1.42, 0.0, 0.55, 0.0)}


def offset(joint, rad):
    home = Bench().home_rad
    return {"measured_rad": tuple(q + rad * (i == joint) for i, q in enumerate(home))}


CASES = {
    "force": (TripReason.FORCE_LIMIT, {"force_N": (0, 0, -19.9)}, {"force_N": (12.0, 0, -16.1)}, "force 20.08 N"),
    "torque": (TripReason.TORQUE_LIMIT, {"torque_Nm": (0, 4.9, 0)}, {"torque_Nm": (0, -5.1, 0)}, "torque 5.10 N m"),
    "torque before taring": (
        TripReason.TORQUE_LIMIT,
        {"torque_Nm": (4.9, 0, 0), "constraints": UNTARED},
        {"torque_Nm": (5.1, 0, 0), "constraints": UNTARED},
        "torque 5.10 N m above the start of the trial, before taring",
    ),
    "unexpected contact": (
        TripReason.UNEXPECTED_CONTACT,
        {"force_N": (0, 2.9, 0), "constraints": FREE},
        {"force_N": (0, 0, -3.2), "constraints": FREE},
        "force 3.20 N in a phase without permitted contact",
    ),
    "saturated": (TripReason.SAMPLE_INVALID, {}, {"wrench": {"validity": Validity.SATURATED}}, "force sample is"),
    "invalid": (
        TripReason.SAMPLE_INVALID,
        {},
        {"joints": {"validity": Validity.INVALID, "position_rad": (nan,) * 6}},
        "joint sample is invalid",
    ),
    "frame": (TripReason.WRENCH_CONTRACT, {}, {"wrench": {"frame": "base"}}, "raw wrenches in the frame 'base'"),
    "kind": (TripReason.WRENCH_CONTRACT, {}, {"wrench": {"kind": WrenchKind.TARED}}, "tared wrenches"),
    "old wrench": (TripReason.SAMPLE_STALE, {}, {"wrench": {"source_time_ns": -20 * MS}}, "force sample 55.7 ms"),
    "old joints": (TripReason.SAMPLE_STALE, {}, {"joints": {"source_time_ns": -70 * MS}}, "joint sample 105.7 ms"),
    "future": (
        TripReason.SAMPLE_STALE,
        {},
        {"wrench": {"source_time_ns": 100 * MS}},
        "force sample is 64.3 ms later than its tick: read() waits",
    ),
    "joint above": (TripReason.JOINT_POSITION, {}, second_joint_at(1.7051), "joint 2 at 1.7051 rad, limit 1.7050"),
    "joint below": (TripReason.JOINT_POSITION, {}, second_joint_at(-1.0751), "joint 2 at -1.0751 rad, limit -1.0750"),
    "arm astray": (TripReason.TRACKING_ERROR, offset(2, -9.9e-3), offset(2, -10.1e-3), "joint 3 is 10.10 mrad"),
    "side": (TripReason.WORKSPACE, tip_at(26.4, -26.4, 0), tip_at(0, -26.6, 0), "tip at y = -26.60 mm"),
    "other side": (TripReason.WORKSPACE, tip_at(-26.4, 26.4, 0), tip_at(26.6, 0, 0), "tip at x = 26.60 mm"),
    "top": (TripReason.WORKSPACE, tip_at(0, 0, -52.9), tip_at(0, 0, -53.1), "tip at z = -53.10 mm"),
    "bottom": (TripReason.WORKSPACE, tip_at(0, 0, 21.9), tip_at(0, 0, 22.1), "tip at z = 22.10 mm"),
    "area": (
        TripReason.EXPLORATION_AREA,
        tip_at(5.4, -4.4, 0) | {"constraints": EXPLORING},
        tip_at(5.6, 0, 0) | {"constraints": EXPLORING},
        "tip 4.60 mm from the centre of the exploration area",
    ),
    "area, across": (
        TripReason.EXPLORATION_AREA,
        tip_at(1, 4.4, 0) | {"constraints": EXPLORING},
        tip_at(1, -4.6, 0) | {"constraints": EXPLORING},
        "tip 4.60 mm from the centre of the exploration area",
    ),
}


class TestLimits:
    @pytest.mark.parametrize("name", CASES)
    def test_trips_at_first_bad_tick_and_not_before(self, name):
        reason, good, bad, said = CASES[name]
        bench = Bench(SupervisionConfig(max_force_N=20.0))
        bench.clean(1)
        bench.clean(4, **good)
        done = bench.tick(**bad)
        trip = bench.tripped
        assert done.command_override.trip is trip
        assert done.command_override.reason is trip.reason is reason
        assert trip.tick == 5
        assert said in trip.text
        assert trip.sample == {"wrench": "force", "joints": "joint"}.get(next(iter(bad)), "")

    def test_force_before_taring_counts_from_start(self):
        bench = Bench(SupervisionConfig(max_force_N=20.0))
        bench.clean(1, force_N=(0, 0, 10.0), constraints=UNTARED)
        bench.clean(4, force_N=(0, 0, -9.9), constraints=UNTARED)
        trip = bench.trip(force_N=(0, 0, -10.1), constraints=UNTARED)
        assert trip.text == "force 20.10 N above the start of the trial, before taring, limit 20 N"

    def test_force_is_scaled_as_the_task_scales_it(self):
        bench = Bench(scale=(1.0, 1.0, 3.0, 1.0, 2.0, 1.0))
        bench.clean(5, force_N=(0, 0, -9.7), torque_Nm=(0, 2.4, 0))
        assert bench.trip(force_N=(0, 0, -9.7), torque_Nm=(0, 2.6, 0)).reason is TripReason.TORQUE_LIMIT
        bench = Bench(scale=(1.0, 1.0, 3.0, 1.0, 1.0, 1.0))
        bench.clean(5, force_N=(0, 0, -9.9))
        assert bench.trip(force_N=(0, 0, -10.1)).text.startswith("force 30.30 N")

    @pytest.mark.parametrize("place", range(3))
    @pytest.mark.parametrize("above", [True, False])
    def test_limit_of_the_workspace_is_inside_and_the_next_number_outside(self, place, above):
        monitor = WorkspaceMonitor(SupervisionConfig(), Workspace((6.5, 7.5), 3.0, 10.0))
        most = ((26.5e-3, 27.5e-3, 22e-3), (-26.5e-3, -27.5e-3, -53e-3))[not above][place]
        for tip, outside in ((most, False), (nextafter(most, inf if above else -inf), True)):
            tip_m = tuple(tip * (each == place) for each in range(3))
            assert (monitor.trip(1, tip_m, TOUCHING, (0.0, 0.0)) is not None) is outside

    @pytest.mark.parametrize(("which", "limit_ms"), [("wrench", 50), ("joints", 100)])
    @pytest.mark.parametrize("sign", [1, -1])
    def test_age_and_gap_at_their_limits_are_allowed_and_a_nanosecond_more_is_not(self, which, limit_ms, sign):
        for more_ns in (0, 1):
            bench = Bench()
            bench.clean(3)
            now = bench.snapshots[-1].time_ns + 50 * MS
            old = {"source_time_ns": now - sign * (limit_ms * MS + more_ns)}
            bench.tick(
                time_ns=now, **({"wrench": {"source_time_ns": now}, "joints": {"source_time_ns": now}} | {which: old})
            )
            assert (bench.supervisor.trip is not None) is bool(more_ns)

    @pytest.mark.parametrize(("good", "bad"), [((0.17, -0.3), (0.18, 0.0)), ((0.0, 0.3), (0.0, -0.36))])
    def test_tool_that_leans_or_turns_too_far_trips(self, good, bad):
        config = SupervisionConfig()
        monitor = WorkspaceMonitor(config, Workspace((6.5, 6.5), 3.0, 10.0, (10.0, 20.0)))
        assert monitor.trip(1, (0.0, 0.0, 0.0), EXPLORING, good) is None
        trip = monitor.trip(2, (0.0, 0.0, 0.0), EXPLORING, bad)
        assert (trip.reason, "limits 10.0 and 20.0 degrees" in trip.text) == (TripReason.WORKSPACE, True)
        flat = WorkspaceMonitor(config, Workspace((6.5, 6.5), 3.0, 10.0))
        assert flat.trip(1, (0.0, 0.0, 0.0), EXPLORING, bad) is None


MS = 1_000_000
TICK_NS = 1_000_000_000 // 140


class TestOverTicks:
    def test_force_may_change_so_fast_and_no_faster(self):
        bench = Bench()
        bench.clean(3)
        bench.clean(1, force_N=(0, 0, -21.4))  # 21.43 N in a period are 3000 N/s
        trip = bench.trip(force_N=(0, 0.0, 0.1))
        assert (trip.reason, trip.tick) == (TripReason.FORCE_RATE, 4)
        assert trip.text == "force changed at 3010 N/s, limit 3000 N/s"

    def test_rate_counts_from_new_sample_to_new_sample(self):
        """Two periods lie between the samples; the repeated one in between says nothing."""
        bench = Bench()
        bench.clean(3)
        old = bench.snapshots[-1].wrench
        bench.clean(1, wrench={"sequence": old.sequence, "source_time_ns": old.source_time_ns})
        bench.clean(1, force_N=(0, 0, -29.0))
        assert bench.trip(force_N=(0, 0, 0.0)).reason is TripReason.FORCE_RATE

    def test_before_taring_contact_is_a_change_since_the_free_phase_began(self):
        free = PhaseConstraints(contact=False)
        bench = Bench()
        # The arm lifts out of a hole: the force of the first sample goes, and is no contact.
        for force in (-5.0, -5.0, -2.0, 0.0):
            bench.clean(1, force_N=(0, 0, force), constraints=UNTARED)
        bench.clean(3, constraints=free)
        bench.clean(1, force_N=(0, 0, -2.9), constraints=free)
        assert bench.trip(force_N=(0, 0, -3.1), constraints=free).reason is TripReason.UNEXPECTED_CONTACT

    def test_every_free_phase_begins_anew(self):
        free = PhaseConstraints(contact=False)
        bench = Bench()
        bench.clean(2, constraints=free)
        bench.clean(1, constraints=UNTARED, force_N=(0, 0, -5.0))
        bench.clean(5, constraints=free, force_N=(0, 0, -5.0))
        assert bench.supervisor.trip is None

    def test_tick_may_be_late_and_not_too_late(self):
        def late(bench, ms):
            now = bench.snapshots[-1].time_ns + round(ms * MS)
            news = {"source_time_ns": now, "receive_time_ns": now}
            return {"time_ns": now, "wrench": news, "joints": news}

        bench = Bench()
        bench.clean(3)
        bench.clean(1, **late(bench, 49.9))
        trip = bench.trip(**late(bench, 50.1))
        assert (trip.reason, trip.tick) == (TripReason.LATE_CYCLE, 4)
        assert trip.text == "time since the last tick 50.1 ms, limit 50 ms"
        bench = Bench()
        bench.clean(3)
        assert bench.trip(**late(bench, -1.0)).reason is TripReason.LATE_CYCLE

    @pytest.mark.parametrize("which", ["wrench", "joints"])
    def test_sensor_may_repeat_itself_fourteen_times(self, which):
        bench = Bench(SupervisionConfig())
        bench.clean(1)
        bench.clean(14, **{which: {"sequence": 0}})
        bench.clean(1)
        bench.clean(14, **{which: {"sequence": 15}})
        trip = bench.trip(**{which: {"sequence": 15}})
        name = "force" if which == "wrench" else "joint"
        assert (trip.reason, trip.tick, trip.sample) == (TripReason.SAMPLE_REPEATED, 30, name)
        assert trip.text == f"no new {name} sample for 15 ticks, limit 14 ticks"

    def test_sensor_that_counts_on_and_never_changes_is_frozen(self):
        bench = Bench(noisy=True)
        bench.clean(6)
        bench.clean(6, torque_Nm=(0, 0, 1e-15))  # one channel differs in its last bits: it lives
        number = bench.snapshots[-1].wrench.sequence
        bench.clean(3, torque_Nm=(0, 0, 1e-15), wrench={"sequence": number})  # no news, counted elsewhere
        trip = bench.trip(torque_Nm=(0, 0, 1e-15))
        assert (trip.reason, trip.tick, trip.sample) == (TripReason.SAMPLE_FROZEN, 15, "force")
        assert trip.text == "6 consecutive new force samples are identical, limit 5"

    def test_joint_that_runs_away_trips(self):
        """1.3 rad/s, limit 1.2, from differences over four periods: seen when all of the window is motion."""
        bench = Bench(SupervisionConfig(max_tracking_error_mrad=500.0, weakened=("max_tracking_error_mrad",)))
        bench.clean(6)
        home = bench.home_rad
        for n in range(1, 20):
            bench.tick(measured_rad=(home[0] + n * 1.3 / 140, *home[1:]), requested_rad=home)
            if bench.supervisor.trip is not None:
                break
        trip = bench.tripped
        assert (trip.reason, n) == (TripReason.JOINT_VELOCITY, 4)
        assert trip.text == "joint 1 moves at 1.300 rad/s, limit 1.200 rad/s"

    def test_steps_of_the_encoder_and_repeated_samples_are_no_velocity(self):
        """A step of 20 mrad between two samples would be 2.8 rad/s; over the window it is 0.7."""
        bench = Bench(SupervisionConfig(max_tracking_error_mrad=500.0, weakened=("max_tracking_error_mrad",)))
        home = bench.home_rad
        bench.clean(6)
        for tick in range(40):
            step = 20e-3 * (tick // 8)
            bench.clean(1, measured_rad=(home[0] + step, *home[1:]), requested_rad=home)
        old = bench.snapshots[-1].joints
        again = {"source_time_ns": old.source_time_ns}  # a new number on an old time
        bench.clean(1, measured_rad=(home[0] + 0.2, *home[1:]), requested_rad=home, joints=again)

    def test_arm_may_lag_by_so_many_ticks(self):
        """At 1 rad/s three ticks are 21 mrad: more than the tolerance, and no fault; four ticks and 10 mrad are one."""

        def lagging(lag, extra_rad, *, old=0):
            bench = Bench()
            bench.clean(10)
            sent = [bench.home_rad] * 10
            for _ in range(30):
                measured = sent[-1 - lag - old]
                requested = (sent[-1][0] + 0.999 / 140, *sent[-1][1:])
                message = {"source_time_ns": bench.snapshots[-1].time_ns - (old - 1) * TICK_NS}
                bench.tick(
                    measured_rad=(measured[0] - extra_rad, *measured[1:]), requested_rad=requested, joints=message
                )
                sent.append(bench.results[-1].command.position_rad)
            return bench

        assert lagging(3, 9.9e-3).supervisor.trip is None
        assert lagging(3, 10.2e-3).tripped.reason is TripReason.TRACKING_ERROR
        assert lagging(5, 0.0).supervisor.trip is not None
        # By the commands of the time at which it was measured, and so far back only.
        assert lagging(3, 9.9e-3, old=2).supervisor.trip is None
        assert lagging(3, 10.2e-3, old=2).supervisor.trip is not None
        assert lagging(3, 9.9e-3, old=6).supervisor.trip is not None

    def test_jump_trips_and_is_not_sent(self):
        bench = Bench()
        bench.clean(3)
        home = bench.home_rad
        done = bench.tick(requested_rad=(home[0] + 0.0501, *home[1:]))
        trip = bench.tripped
        assert (trip.reason, trip.tick) == (TripReason.COMMAND_JUMP, 3)
        assert trip.text == "a joint's command jumps by 50.1 mrad, limit 50 mrad"
        assert abs(done.command.position_rad[0] - home[0]) < 1e-3
        assert done.command_override.requested_rad[0] == home[0] + 0.0501

    @pytest.mark.parametrize(
        ("answer", "said"), [((nan,) * 6, "6 non-finite joint angles"), ((0.1,) * 5, ""), ((), "")]
    )
    def test_arm_that_says_nonsense_trips(self, answer, said):
        bench = Bench()
        bench.clean(3)
        bench.applied = AppliedCommand(answer, CommandReason.VELOCITY_LIMIT)
        done = bench.tick(measured_rad=bench.home_rad, requested_rad=bench.home_rad)
        trip = bench.tripped
        assert trip.reason is TripReason.COMMAND_NOT_FINITE
        assert f"the arm reports an applied command with {said}" in trip.text
        assert done.command.position_rad == pytest.approx(bench.home_rad, abs=1e-3)

    @pytest.mark.parametrize("moves_before", [0, 1])
    def test_joint_that_shows_one_angle_in_fourteen_new_samples_while_its_commands_go_on_is_found(self, moves_before):
        bench = Bench()
        first, *others = bench.home_rad
        bench.clean(moves_before, measured_rad=(first - 1e-5, *others))
        for tick in range(40):
            bench.tick(measured_rad=bench.home_rad, requested_rad=(first + 5e-4 * tick, *others))
        assert bench.tripped.reason is TripReason.TRACKING_ERROR
        assert "while its commands span" in bench.tripped.text
        assert bench.tripped.tick == 13 + 2 * moves_before
