"""Detection of conditions that latch a stop and that an operator must check."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from palpate.drivers.cia402.codec import CSP, FAULTS, NMT_OPERATIONAL, DriveState, Status
from palpate.drivers.cia402.mailbox import NodeBox
from palpate.drivers.cia402.settings import POSE_MARGIN_RAD, ArmSettings, JointDrive
from palpate.drivers.errors import DeviceFaultError, DriverError, LateError, SilentError

_MS: Final = 1_000_000
_REMEDY: Final = "find out why, then acknowledge"
_HOST_UNHEARD: Final = 0x8130
"""Heartbeat error (CiA 301)."""
_KEEP_TIME: Final = "end other work here, ask for real-time scheduling or raise [arm] timeout_scale, then acknowledge"


@dataclass(frozen=True, slots=True)
class AxisView:
    """State of one joint at the last SYNC; unknown values are None.

    Attributes:
        state: State in the statusword; also None if it matches no pattern.
        position_rad: Position as a joint angle.
        moved_counts: Change in the position counts since the previous reply.
        mode: Operating mode reported by the drive.
    """

    box: NodeBox
    statusword: int | None
    state: DriveState | None
    counts: int | None
    position_rad: float | None
    moved_counts: int
    missed_in_a_row: int
    mode: int | None = None


def fault_of(
    views: Sequence[AxisView], settings: ArmSettings, now_ns: int, allowed: Sequence[DriveState] | None
) -> DriverError | None:
    """Return the most significant problem, or None if there is none.

    Args:
        allowed: Permitted states of a powered drive, or None while the arm must be without power. Drive faults and the
            pose are then ignored, because nothing moves.
    """
    axes = list(zip(views, settings.joints, strict=True))
    for check in (_restarted, _reports, _silent):
        for view, joint in axes:
            for error in check(view, joint, settings, now_ns):
                return error
    if allowed is not None:
        for view, joint in axes:
            for error in (
                *_left(view, joint, allowed),
                *_disobeys(view, joint),
                *_astray(view, joint),
            ):
                return error
    return None


def outside(position_rad: float, joint: JointDrive) -> bool:
    """Return True if a measured angle exceeds the joint's limits by more than the margin."""
    return not joint.lower_rad - POSE_MARGIN_RAD <= position_rad <= joint.upper_rad + POSE_MARGIN_RAD


def _restarted(view: AxisView, joint: JointDrive, _settings: ArmSettings, _now_ns: int) -> Iterator[DriverError]:
    if view.box.boots > 0:
        yield DeviceFaultError(f"drive {joint.node}", "restarted and lost its configuration", _REMEDY)
    elif view.box.nmt_state not in (None, NMT_OPERATIONAL):
        problem = f"is no longer operational (NMT state 0x{view.box.nmt_state:02X})"
        yield DeviceFaultError(f"drive {joint.node}", problem, _REMEDY)


def _reports(view: AxisView, joint: JointDrive, settings: ArmSettings, _now_ns: int) -> Iterator[DriverError]:
    if view.box.active:
        worst = view.box.active[0]
        if worst.code == _HOST_UNHEARD:
            problem = f"has not heard from this computer for {settings.host_watchdog_ms} ms (EMCY 0x{worst.code:04X})"
            yield LateError(f"drive {joint.node}", problem, f"check the bus cable, or {_KEEP_TIME}")
        problem = (
            f"reports EMCY 0x{worst.code:04X} (register 0x{worst.register:02X}, maker's bytes {worst.vendor.hex()})"
        )
        yield DeviceFaultError(f"drive {joint.node}", problem, "look the code up in its manual, then acknowledge")


def _silent(view: AxisView, joint: JointDrive, settings: ArmSettings, now_ns: int) -> Iterator[DriverError]:
    silence_ms = (now_ns - view.box.heartbeat_ns) / _MS
    if silence_ms > settings.heartbeat_timeout_ms:
        problem = f"no heartbeat for {silence_ms:.0f} ms (limit {settings.heartbeat_timeout_ms})"
        yield SilentError(f"drive {joint.node}", problem, "check its power and cable, then acknowledge")
    elif view.missed_in_a_row >= settings.missed_cycles:
        problem = f"{view.missed_in_a_row} SYNCs in a row were not answered in time"
        remedy = f"check its power, its cable and the bus load; on a busy computer {_KEEP_TIME}"
        yield SilentError(f"drive {joint.node}", problem, remedy)


def _left(view: AxisView, joint: JointDrive, allowed: Sequence[DriveState]) -> Iterator[DriverError]:
    if view.statusword is None or view.state in allowed:
        return
    report = f"statusword 0x{view.statusword:04X}"
    if view.state in FAULTS:
        why = ", following error" if view.statusword & Status.FOLLOWING_ERROR else ""
        yield DeviceFaultError(f"drive {joint.node}", f"is in fault ({report}{why})", _REMEDY)
    else:
        state = "no known state" if view.state is None else f"'{view.state.value}'"
        yield DeviceFaultError(f"drive {joint.node}", f"went to {state} by itself ({report})", _REMEDY)


def _disobeys(view: AxisView, joint: JointDrive) -> Iterator[DriverError]:
    if view.statusword is None or view.state is not DriveState.ENABLED:
        return
    word = view.statusword
    problems = (
        (view.mode != CSP, f"is in mode {view.mode}, not in CSP (another master",
         "see what else is on the bus"),
        (bool(word & Status.FOLLOWING_ERROR), "has fallen behind its set-points (following error",
         "see whether the joint is blocked"),
        (not word & Status.REMOTE, "does not obey this bus (remote", "switch it from local to remote control"),
    )  # fmt: skip
    for is_so, problem, remedy in problems:
        if is_so:
            report = f"{problem}, statusword 0x{word:04X})"
            yield DeviceFaultError(f"drive {joint.node}", report, f"{remedy}, then acknowledge")


def _astray(view: AxisView, joint: JointDrive) -> Iterator[DriverError]:
    if view.position_rad is not None and outside(view.position_rad, joint):
        problem = f"is at {view.position_rad:.4f} rad, outside {joint.lower_rad} to {joint.upper_rad}"
        yield DeviceFaultError(f"drive {joint.node}", problem, "move the joint back by hand, then acknowledge")
