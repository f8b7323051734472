"""Command sequences for the six motors, and the states of their servos."""

import enum
from collections.abc import Callable, Sequence
from typing import Final

from palpate.drivers.errors import DriverError, SilentError, WiringError
from palpate.drivers.nmc import (
    NOP,
    RESET_POS,
    SERVO,
    STICKY_STATUS,
    Aux,
    Module,
    NmcBus,
    NmcCommand,
    NmcStatus,
    Reply,
    StopControl,
    TrajectoryControl,
    acceleration_word,
    attach,
    def_stat,
    load_traj,
    read_stat,
    stop_motor,
    velocity_word,
)
from palpate.drivers.zebra_zero.codec import DEVICE, JOINTS, SixCounts
from palpate.drivers.zebra_zero.faults import ArmFaultError, FaultKind, fault_in
from palpate.drivers.zebra_zero.settings import (
    FIRMWARE_WITH_MOVING_TARGETS,
    GAINS,
    PROFILE_MARGIN,
    REPLY_ITEMS,
    STORED_TOLERANCE_COUNTS,
    Streaming,
    ZebraZeroSettings,
)

SMOOTH: Final = stop_motor(StopControl.AMP_ENABLE | StopControl.SMOOTH)
ABRUPT: Final = stop_motor(StopControl.AMP_ENABLE | StopControl.ABRUPT)
_POLL_S: Final = 0.002
_DEAD_S: Final = 0.3
"""Time without a reply after which a stop treats the line as dead."""
_DEAD_TRIES: Final = 3
"""Minimum number of unanswered requests before the line counts as dead, regardless of the bus time-outs."""


class StopOutcome(enum.Enum):
    """Result of a stop."""

    NOTHING_ON = "no servo was on"
    STATIONARY = "every motor was seen stationary"
    NOT_SEEN = "not every motor was seen stationary"
    LINE_DEAD = "no motor could be reached"


def bring_to_rest(
    bus: NmcBus,
    addresses: Sequence[int],
    timeout_s: float,
    clock_ns: Callable[[], int],
    *,
    are_all: bool,
) -> StopOutcome:
    """Stop the motors smoothly with their amplifiers on, or abruptly after a time-out.

    If the line is dead, the command is sent once, without waiting.

    Args:
        addresses: Modules whose servos are on. A servo that has switched itself off stays off.
    """
    if not addresses:
        return StopOutcome.NOTHING_ON
    begin_ns = clock_ns()
    deadline_ns, dead_ns = begin_ns + round(timeout_s * 1e9), begin_ns + round(_DEAD_S * 1e9)
    reached: set[int] = set()
    moving = set(addresses)
    replies = tries = 0
    try:
        if are_all:
            bus.group(SMOOTH)
        # Modules that never answer, such as one that has restarted, do not prolong the stop.
        while moving and clock_ns() < (deadline_ns if moving & reached or tries <= len(addresses) else dead_ns):
            for address in sorted(moving):
                replies, tries = replies + _poll(bus, address, reached, moving), tries + 1
                if not replies and tries >= _DEAD_TRIES and clock_ns() >= dead_ns:
                    bus.broadcast(addresses, ABRUPT)
                    return StopOutcome.LINE_DEAD
            bus.wait_s(_POLL_S)
        if moving:
            # Send each twice, because the line may damage the first; do not wait for their replies.
            bus.broadcast(sorted(moving), ABRUPT)
    except DriverError:
        return StopOutcome.LINE_DEAD
    if not moving:
        return StopOutcome.STATIONARY
    return StopOutcome.NOT_SEEN if reached else StopOutcome.LINE_DEAD


def _poll(bus: NmcBus, address: int, reached: set[int], moving: set[int]) -> bool:
    reply = bus.attempt(address, NOP)
    if not isinstance(reply, Reply):
        return False
    if reply.status & STICKY_STATUS:
        reached.add(address)
        moving.discard(address)
    elif address not in reached:
        # Modules do not acknowledge a group command, so each one receives its own command.
        if isinstance(bus.attempt(address, SMOOTH), Reply):
            reached.add(address)
    elif reply.status & NmcStatus.MOVE_DONE:
        moving.discard(address)
    return True


AXES: Final = tuple(range(1, JOINTS + 1))
"""Module addresses; motor n is module n. FACT: the port."""
GO_HOME: Final = "bring the arm to its home pose by hand and switch its controller off and on"
"""Remedy if the counters are invalid."""
_OFF: Final = stop_motor(StopControl.MOTOR_OFF)
_STREAMED: Final = TrajectoryControl.SERVO | TrajectoryControl.START_NOW


def check_modules(modules: tuple[Module, ...]) -> tuple[Module, ...]:
    """Return the modules; raise an error unless they are six servos."""
    kinds = [module.identity.name for module in modules]
    if len(modules) != JOINTS or any(module.identity.type_code != SERVO for module in modules):
        raise WiringError(
            DEVICE, f"found {len(modules)} modules ({'; '.join(kinds)})", f"connect {JOINTS} servo modules"
        )
    return modules


def streaming_for(modules: tuple[Module, ...]) -> Streaming:
    """Return the method for sending set-points to these modules."""
    is_documented = all(module.identity.version == FIRMWARE_WITH_MOVING_TARGETS for module in modules)
    return Streaming.TRAPEZOID if is_documented else Streaming.STOP_HERE


def setpoint(streaming: Streaming, counts: int) -> NmcCommand:
    """Return the command that moves a motor to a position; it has nine bytes with either method."""
    if streaming is Streaming.TRAPEZOID:
        return load_traj(_STREAMED, counts)
    return stop_motor(StopControl.AMP_ENABLE | StopControl.HERE, counts)


class Servos:
    """The arm's motors, with positions in counts only; ``on`` contains the axes, 1 to 6, whose servos are on."""

    def __init__(self, bus: NmcBus, settings: ZebraZeroSettings) -> None:
        self._bus, self._settings = bus, settings
        self.on: set[int] = set()

    def attach(self) -> tuple[Module, ...] | None:
        """Return the modules from an earlier run, or None if no module has kept its address."""
        try:
            return attach(self._bus, JOINTS)
        except SilentError as error:
            raise SilentError(DEVICE, f"not all modules still answer ({error})", GO_HOME) from error

    def meet(self) -> SixCounts:
        """Set the reply items of every module, and read all positions and the on/off state of each servo."""
        counts = []
        for axis in AXES:
            self._bus.require(axis, def_stat(REPLY_ITEMS))
            reply = self._look(axis)
            counts.append(_position(reply))
            self._mark(axis, is_on=bool(reply.aux and reply.aux & Aux.SERVO_ON))
        return tuple(counts)

    def zero(self) -> None:
        """Switch every motor off and set its counter to zero; only for an arm in its home pose."""
        self.off()
        for axis in AXES:
            self._bus.require(axis, RESET_POS)
            found = _position(self._look(axis))
            if abs(found) > STORED_TOLERANCE_COUNTS:
                problem = f"motor {axis} counts {found} right after its counter was set to zero"
                raise WiringError(DEVICE, problem, "see whether the arm moves, and whether the module is a servo")

    def check(self) -> tuple[SixCounts, ArmFaultError | None]:
        """Send the gains and check every axis before anything is switched on."""
        fault: ArmFaultError | None = None
        counts = []
        for axis in AXES:
            self._bus.require(axis, def_stat(REPLY_ITEMS))
            self._bus.require(axis, GAINS)
            reply = self._look(axis)
            counts.append(_position(reply))
            fault = fault or fault_in(axis, reply, self._settings, should_be_on=axis in self.on)
            if self._settings.require_power and not reply.status & NmcStatus.POWER_ON:
                fault = fault or ArmFaultError(FaultKind.POWER_LOST, axis)
        return tuple(counts), fault

    def enable(self, axis: int) -> ArmFaultError | None:
        """Engage a servo to hold its motor in its current position; return a fault, if any.

        The abrupt stop makes the current position the position to hold, and the trapezoid that loads velocity and
        acceleration for later ends at that same position, so nothing moves.
        """
        was_on = axis in self.on
        if not was_on:
            self._bus.require(axis, _OFF)
        # From here on the servo may be on, even if there is no reply.
        self.on.add(axis)
        held = _position(self._bus.require(axis, ABRUPT))
        if not was_on:
            # A servo that is off shows a position error; check() has found no other sticky bit.
            self._bus.clear_bits(axis)
        fault = fault_in(axis, self._look(axis), self._settings, should_be_on=True)
        if fault is None:
            self._bus.require(axis, self._profile(axis, held))
        return fault

    def off(self) -> None:
        """Switch every motor off, so that nothing holds the arm."""
        lost = []
        for axis in AXES:
            # Without require(), because one lost motor must not keep the others on.
            if any(isinstance(self._bus.attempt(axis, _OFF), Reply) for _ in range(2)):
                self.on.discard(axis)
            else:
                lost.append(axis)
        if lost:
            raise SilentError(DEVICE, f"motors {lost} did not confirm that they are off", "switch off their supply")

    def clear(self) -> ArmFaultError | None:
        """Clear every module's sticky bits and return any remaining fault. Only a person may decide to do this."""
        remaining: ArmFaultError | None = None
        for axis in AXES:
            self._bus.clear_bits(axis)
            fault = fault_in(axis, self._look(axis), self._settings, should_be_on=axis in self.on)
            remaining = remaining or fault
        return remaining

    def _look(self, axis: int) -> Reply:
        return self._bus.require(axis, read_stat(REPLY_ITEMS))

    def _mark(self, axis: int, *, is_on: bool) -> None:
        if is_on:
            self.on.add(axis)
        else:
            self.on.discard(axis)

    def _profile(self, axis: int, position_counts: int) -> NmcCommand:
        settings, limits = self._settings, self._settings.limits
        speeds = settings.transmission.motor_rates((PROFILE_MARGIN * limits.velocity_rad_per_s,) * JOINTS)
        rates = settings.transmission.motor_rates((PROFILE_MARGIN * limits.acceleration_rad_per_s2,) * JOINTS)
        words = velocity_word(speeds[axis - 1]), acceleration_word(rates[axis - 1])
        return load_traj(_STREAMED, position_counts, *words)


def _position(reply: Reply) -> int:
    # The mask had POSITION, so an accepted reply also has it.
    return reply.position_counts or 0
