"""Monitors for force, joints, samples and workspace. Forces are unfiltered, because a filter lags by half an action."""

from collections import deque
from collections.abc import Sequence
from math import degrees, radians, sqrt
from operator import le, sub
from typing import Final

from palpate.core.errors import DeviceError
from palpate.core.ports import (
    CONTROL_RATE_HZ,
    SENSOR_FRAME,
    JointVector,
    SensorFacts,
    Snapshot,
    Validity,
    Vector3,
    WrenchKind,
    WrenchSample,
)
from palpate.core.supervision.config import SupervisionConfig
from palpate.core.trial import PhaseConstraints, Trip, TripReason, Workspace

_SHORTEST_NS = 1_000_000_000 // CONTROL_RATE_HZ // 2
"""Shortest time over which a rate is computed; between closer samples, noise would look like a rate."""


class WrenchMonitor:
    """Monitor for force, torque, force rate, and unexpected contact.

    Args:
        scale: Scale factors for the sensor's six channels after taring, (6,).
    """

    def __init__(self, config: SupervisionConfig, scale: tuple[float, ...]) -> None:
        self._force_N, self._torque_Nm = config.max_force_N, config.max_torque_Nm
        self._rate_N_s, self._contact_N = config.max_force_rate_N_s, config.unexpected_contact_N
        self._force_square, self._torque_square = self._force_N**2, self._torque_Nm**2
        self._rate_N_ns, self._contact_square = self._rate_N_s * 1e-9, self._contact_N**2
        self._force_scale, self._torque_scale = scale[:3], scale[3:]

    def begin(self) -> None:
        """Reset the state for a new trial."""
        self._first: tuple[float, ...] | None = None
        self._free: Vector3 | None = None
        self._sequence: int
        self._last: Vector3
        self._last_ns: int

    def trip(self, snapshot: Snapshot, constraints: PhaseConstraints) -> Trip | None:
        """Return the trip for the current, valid wrench, or None if the wrench is within limits."""
        wrench, bias = snapshot.wrench, constraints.bias
        force_N = wrench.force_N
        if self._first is None:
            self._first = (*force_N, *wrench.torque_Nm)
            self._last, self._last_ns, self._sequence = force_N, wrench.source_time_ns, wrench.sequence
        zero = self._first if bias is None else bias
        square = _square(force_N, zero[:3], self._force_scale)
        # All comparisons are written so that NaN trips.
        if not square <= self._force_square:
            return _exceeded(TripReason.FORCE_LIMIT, snapshot.tick, "force", sqrt(square), self._force_N, bias)
        torque = _square(wrench.torque_Nm, zero[3:], self._torque_scale)
        if not torque <= self._torque_square:
            return _exceeded(
                TripReason.TORQUE_LIMIT, snapshot.tick, "torque", sqrt(torque), self._torque_Nm, bias, "N m"
            )
        if wrench.sequence != self._sequence:
            self._sequence = wrench.sequence
            change = _square(force_N, self._last, self._force_scale)
            dt_ns = max(wrench.source_time_ns - self._last_ns, _SHORTEST_NS)
            self._last, self._last_ns = force_N, wrench.source_time_ns
            most = self._rate_N_ns * dt_ns
            if not change <= most * most:
                rate, limit = sqrt(change) / dt_ns * 1e9, self._rate_N_s
                text = f"force changed at {rate:.0f} N/s, limit {limit:g} N/s"
                return Trip(TripReason.FORCE_RATE, snapshot.tick, text)
        if constraints.contact:
            self._free = None
            return None
        return self._contact(snapshot, square, bias is not None)

    def _contact(self, snapshot: Snapshot, square: float, tared: bool) -> Trip | None:
        """Check for contact; before taring, only the change since the phase began is known."""
        if not tared:
            if self._free is None:
                self._free = snapshot.wrench.force_N
            square = _square(snapshot.wrench.force_N, self._free, self._force_scale)
        if square <= self._contact_square:
            return None
        force, limit = sqrt(square), self._contact_N
        text = f"force {force:.2f} N in a phase without permitted contact, limit {limit:g} N"
        return Trip(TripReason.UNEXPECTED_CONTACT, snapshot.tick, text)


def _square(vector: Vector3, zero: Sequence[float], scale: Sequence[float]) -> float:
    """Return the squared norm of a scaled vector relative to an offset, (3,) each."""
    (x, y, z), (u, v, w), (a, b, c) = vector, zero, scale
    x, y, z = (x - u) * a, (y - v) * b, (z - w) * c
    return x * x + y * y + z * z


def _exceeded(
    reason: TripReason, tick: int, what: str, value: float, limit: float, bias: object, unit: str = "N"
) -> Trip:
    since = " above the start of the trial, before taring" if bias is None else ""
    return Trip(reason, tick, f"{what} {value:.2f} {unit}{since}, limit {limit:g} {unit}")


_WINDOW_NS: Final = 25_000_000
"""Minimum time between samples for a velocity, so that an encoder step has little effect."""
_STUCK_SHARE: Final = 0.3
"""Fraction of the tracking limit. Commands that span this range move a joint by many encoder steps at any lag."""
_STUCK_SAMPLES: Final = CONTROL_RATE_HZ // 10
"""Number of samples with the same angle; a servo barely follows a faster dither."""
_OLDEST_NS: Final = 4_000_000_000 // CONTROL_RATE_HZ
"""Age of the oldest command, four ticks, with which an old or repeated sample is compared."""


class JointMonitor:
    """Monitor that compares measured joint angles with the arm's limits and with the commands.

    Args:
        lower_rad: The arm's lower joint limits, (n,).
        upper_rad: Upper joint limits, (n,).
        velocity_limit_rad_s: Joint velocity limits, (n,).
    """

    def __init__(
        self,
        config: SupervisionConfig,
        lower_rad: JointVector,
        upper_rad: JointVector,
        velocity_limit_rad_s: JointVector,
    ) -> None:
        slack = config.joint_slack_mrad * 1e-3
        self._lower = tuple(q - slack for q in lower_rad)
        self._upper = tuple(q + slack for q in upper_rad)
        self._velocity = tuple(v * config.max_joint_velocity_share for v in velocity_limit_rad_s)
        self._least_velocity_rad_ns = min(self._velocity) * 1e-9
        self._tracking_rad = config.max_tracking_error_mrad * 1e-3
        self._stuck_rad = _STUCK_SHARE * self._tracking_rad
        self._lag_ns = round((config.tracking_lag_ticks + 1.5) * 1e9 / CONTROL_RATE_HZ)
        self._commands: deque[tuple[int, JointVector]] = deque()
        self._samples: deque[tuple[int, JointVector]] = deque()

    def begin(self) -> None:
        """Reset the state for a new trial."""
        self._commands.clear()
        self._samples.clear()
        self._before_ns: int | None = None
        self._same: list[tuple[float, int, float, float]] = []

    def trip(self, snapshot: Snapshot, held_rad: JointVector) -> Trip | None:
        """Return the trip for the current, valid joint angles, or None if they are within limits.

        Args:
            held_rad: Command sent in the previous tick, (n,).
        """
        joints = snapshot.joints
        q = joints.position_rad
        if not (all(map(le, self._lower, q)) and all(map(le, q, self._upper))):
            angles = enumerate(zip(q, self._lower, self._upper, strict=True), start=1)
            number, (value, low, high) = next(one for one in angles if not one[1][1] <= one[1][0] <= one[1][2])
            text = f"joint {number} at {value:.4f} rad, limit {low if value < low else high:.4f} rad"
            return Trip(TripReason.JOINT_POSITION, snapshot.tick, text)
        samples, now_ns, is_new = self._samples, joints.source_time_ns, False
        # A repeated reading, even under a new number, gives no velocity.
        if not samples or now_ns > samples[-1][0]:
            samples.append((now_ns, q))
            is_new = True
            while len(samples) > 1 and now_ns - samples[1][0] >= _WINDOW_NS:
                samples.popleft()
            then_ns, then = samples[0]
            dt_ns = now_ns - then_ns
            if dt_ns >= _WINDOW_NS and max(map(abs, map(sub, q, then))) > self._least_velocity_rad_ns * dt_ns:
                trip = self._fast(snapshot.tick, q, then, dt_ns * 1e-9)
                if trip is not None:
                    return trip
        commands = self._commands
        # A sample is compared with the commands at its own time: on a slow bus, it is several ticks old.
        first_ns = max(now_ns, snapshot.time_ns - _OLDEST_NS) - self._lag_ns
        while commands and commands[0][0] < first_ns:
            commands.popleft()
        commands.append((snapshot.time_ns if self._before_ns is None else self._before_ns, held_rad))
        self._before_ns = snapshot.time_ns
        if max(map(abs, map(sub, q, commands[0][1]))) > self._tracking_rad:
            return self._astray(snapshot.tick, q)
        return self._stuck(snapshot.tick, q, commands[0][1]) if is_new else None

    def _stuck(self, tick: int, q: JointVector, command_rad: JointVector) -> Trip | None:
        """Trip if all new samples for a joint show the same angle even though its earlier commands changed."""
        if not self._same:
            self._same = [(angle, 0, command, command) for angle, command in zip(q, command_rad, strict=True)]
        same = self._same
        for joint, (angle, command) in enumerate(zip(q, command_rad, strict=True)):
            before, samples, low, high = same[joint]
            if angle != before:
                same[joint] = (angle, 0, command, command)
                continue
            samples, low, high = samples + 1, min(low, command), max(high, command)
            same[joint] = (angle, samples, low, high)
            if samples >= _STUCK_SAMPLES and high - low > self._stuck_rad:
                span = f"{(high - low) * 1e3:.2f} mrad"
                text = f"joint {joint + 1} reads {angle:.4f} rad while its commands span {span}"
                return Trip(TripReason.TRACKING_ERROR, tick, text)
        return None

    def _fast(self, tick: int, q: JointVector, then: JointVector, dt_s: float) -> Trip | None:
        for number, (now, before, limit) in enumerate(zip(q, then, self._velocity, strict=True), start=1):
            velocity = abs(now - before) / dt_s
            if velocity > limit:
                text = f"joint {number} moves at {velocity:.3f} rad/s, limit {limit:.3f} rad/s"
                return Trip(TripReason.JOINT_VELOCITY, tick, text)
        return None

    def _astray(self, tick: int, q: JointVector) -> Trip | None:
        """Trip if a joint is outside the range of commands in the last ticks; an arm that lags is inside it."""
        limit, held = self._tracking_rad, [each for _, each in self._commands]
        for number, (value, commands) in enumerate(zip(q, zip(*held, strict=True), strict=True), start=1):
            error = max(min(commands) - value, value - max(commands))
            if error > limit:
                text = f"joint {number} is {error * 1e3:.2f} mrad from its command, limit {limit * 1e3:g} mrad"
                return Trip(TripReason.TRACKING_ERROR, tick, text)
        return None


_NS_PER_MS = 1e6


class SampleMonitor:
    """Monitor for the validity, age and progress of encoder and force samples, and for the time between ticks.

    Args:
        sensor: Facts about the sensor. All wrenches use its frame. If it has noise, equal samples mean that it froze.
    """

    def __init__(self, config: SupervisionConfig, sensor: SensorFacts) -> None:
        self._force_age_ns = round(config.max_force_age_ms * _NS_PER_MS)
        self._joint_age_ns = round(config.max_joint_age_ms * _NS_PER_MS)
        self._gap_ns = round(config.max_gap_ms * _NS_PER_MS)
        self._most_repeats, self._most_equal = config.max_repeats, config.max_equal_samples
        self._noisy, self._frame = sensor.noise_N > 0.0, sensor.frame

    def begin(self) -> None:
        """Reset the state for a new trial."""
        self._last_ns: int | None = None
        self._sequences: tuple[int | None, int | None] = (None, None)
        self._wrench_repeats: int
        self._joint_repeats: int
        self._equal: int
        self._values: tuple[Vector3, Vector3] | None = None

    def trip(self, snapshot: Snapshot) -> Trip | None:
        """Return the trip for the current samples, or None if they are acceptable."""
        wrench, joints, now_ns = snapshot.wrench, snapshot.joints, snapshot.time_ns
        if wrench.validity is not Validity.VALID:
            return self._not_valid(snapshot.tick, "force", wrench.validity)
        if joints.validity is not Validity.VALID:
            return self._not_valid(snapshot.tick, "joint", joints.validity)
        if wrench.kind is not WrenchKind.RAW or wrench.frame != self._frame:
            text = f"{_wrench_text(wrench)}; expected raw wrenches in {self._frame!r}"
            return Trip(TripReason.WRENCH_CONTRACT, snapshot.tick, text, "force")
        last_ns, self._last_ns = self._last_ns, now_ns
        if last_ns is not None and not 0 <= now_ns - last_ns <= self._gap_ns:
            return _times(
                TripReason.LATE_CYCLE, snapshot.tick, "time since the last tick", now_ns - last_ns, self._gap_ns
            )
        age_ns, most_ns = now_ns - wrench.source_time_ns, self._force_age_ns
        # A sample from the future is just as bad: the clocks disagree, so the age is meaningless.
        if not -most_ns <= age_ns <= most_ns:
            return _times(TripReason.SAMPLE_STALE, snapshot.tick, "age of the force sample", age_ns, most_ns, "force")
        age_ns, most_ns = now_ns - joints.source_time_ns, self._joint_age_ns
        if not -most_ns <= age_ns <= most_ns:
            return _times(TripReason.SAMPLE_STALE, snapshot.tick, "age of the joint sample", age_ns, most_ns, "joint")
        last_wrench, last_joints = self._sequences
        if wrench.sequence != last_wrench:
            last_values, self._values = self._values, (wrench.force_N, wrench.torque_Nm)
            if self._values != last_values:
                self._equal = 0
            elif self._noisy:
                self._equal += 1
                if self._equal > self._most_equal:
                    return self._frozen(snapshot.tick)
        self._sequences = (wrench.sequence, joints.sequence)
        if wrench.sequence == last_wrench or joints.sequence == last_joints:
            return self._repeated(snapshot.tick, wrench.sequence == last_wrench, joints.sequence == last_joints)
        self._wrench_repeats = self._joint_repeats = 0
        return None

    def _repeated(self, tick: int, wrench: bool, joints: bool) -> Trip | None:
        self._wrench_repeats = self._wrench_repeats + 1 if wrench else 0
        self._joint_repeats = self._joint_repeats + 1 if joints else 0
        repeats, most = max(self._wrench_repeats, self._joint_repeats), self._most_repeats
        if repeats <= most:
            return None
        name = "force" if repeats == self._wrench_repeats else "joint"
        text = f"no new {name} sample for {repeats} ticks, limit {most} ticks"
        return Trip(TripReason.SAMPLE_REPEATED, tick, text, name)

    def _frozen(self, tick: int) -> Trip:
        found, most = self._equal, self._most_equal
        text = f"{found} consecutive new force samples are identical, limit {most}"
        return Trip(TripReason.SAMPLE_FROZEN, tick, text, "force")

    @staticmethod
    def _not_valid(tick: int, name: str, validity: Validity) -> Trip:
        return Trip(TripReason.SAMPLE_INVALID, tick, f"the {name} sample is {validity.value}", name)


def require_raw(wrench: WrenchSample, frame: str = SENSOR_FRAME) -> None:
    """Before anything moves, reject a wrench of the wrong kind or in the wrong frame.

    Raises:
        DeviceError: The wrench is of the wrong kind or in the wrong frame.
    """
    if wrench.kind is not WrenchKind.RAW or wrench.frame != frame:
        raise DeviceError("force sensor", f"{_wrench_text(wrench)}; the task requires raw wrenches in {frame!r}")


def _wrench_text(wrench: WrenchSample) -> str:
    return f"{wrench.kind.value} wrenches in the frame {wrench.frame!r}"


def _times(reason: TripReason, tick: int, what: str, found_ns: int, limit_ns: int, sample: str = "") -> Trip:
    found, limit = found_ns / _NS_PER_MS, limit_ns / _NS_PER_MS
    text = f"{what} {found:.1f} ms"
    if sample and found < 0.0:
        text = f"the {sample} sample is {-found:.1f} ms later than its tick: read() waits, or its clock is ahead"
    return Trip(reason, tick, f"{text}, limit {limit:g} ms", sample)


class WorkspaceMonitor:
    """Monitor that compares the tip position with the workspace, a box in the task frame, and the exploration area."""

    def __init__(self, config: SupervisionConfig, workspace: Workspace) -> None:
        self._sides_m = tuple((side + config.side_margin_mm) * 1e-3 for side in workspace.side_mm)
        self._top_m = -(workspace.above_mm + config.height_margin_mm) * 1e-3
        self._bottom_m = (workspace.below_mm + config.depth_margin_mm) * 1e-3
        self._margin_m = config.area_margin_mm * 1e-3
        self._turns_rad = tuple(map(radians, workspace.turns_deg or (360.0, 360.0)))

    def trip(
        self, tick: int, tip_m: Vector3, constraints: PhaseConstraints, turned_rad: tuple[float, float]
    ) -> Trip | None:
        """Return the trip for the tip position, or None if it is inside the limits.

        Args:
            tip_m: Tip position from the encoders, (3,), task frame.
            turned_rad: Tool tilt and yaw, (2,).
        """
        x, y, z = tip_m
        aside, across = self._sides_m
        # Written so that NaN trips.
        if not -aside <= x <= aside:
            return _left_workspace(tick, "x", x, -aside, aside)
        if not -across <= y <= across:
            return _left_workspace(tick, "y", y, -across, across)
        if not self._top_m <= z <= self._bottom_m:
            return _left_workspace(tick, "z", z, self._top_m, self._bottom_m)
        if not (turned_rad[0] <= self._turns_rad[0] and abs(turned_rad[1]) <= self._turns_rad[1]):
            found, limits = (
                " and ".join(f"{degrees(each):.1f}" for each in pair) for pair in (turned_rad, self._turns_rad)
            )
            text = f"tool is tilted and turned by {found} degrees, limits {limits} degrees"
            return Trip(TripReason.WORKSPACE, tick, text)
        area = constraints.area
        if area is None:
            return None
        (cx, cy), most = area.centre_m, area.half_width_m + self._margin_m
        if -most <= x - cx <= most and -most <= y - cy <= most:
            return None
        value, limit = max(abs(x - cx), abs(y - cy)) * 1e3, most * 1e3
        text = f"tip {value:.2f} mm from the centre of the exploration area, limit {limit:g} mm"
        return Trip(TripReason.EXPLORATION_AREA, tick, text)


def _left_workspace(tick: int, axis: str, place_m: float, low_m: float, high_m: float) -> Trip:
    value, limit = place_m * 1e3, (low_m if place_m < low_m else high_m) * 1e3
    text = f"tip at {axis} = {value:.2f} mm in the task frame, workspace limit {limit:g} mm"
    return Trip(TripReason.WORKSPACE, tick, text)
