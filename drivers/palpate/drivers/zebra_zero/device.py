"""Driver for the Zebra Zero. It finds, enables, moves and stops the arm in the caller's loop and uses no threads."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Protocol

from typing_extensions import override

from palpate.drivers.device import ArmState, LatchingArm, Measured, clamped, held_back, listed, require_angles
from palpate.drivers.errors import DeviceFaultError, DriverError, SilentError, StateError, WiringError
from palpate.drivers.nmc import NOP, Aux, Module, NmcBus, NmcCommand, NmcStatus, start
from palpate.drivers.serial_port import ByteStream
from palpate.drivers.zebra_zero import servos
from palpate.drivers.zebra_zero.codec import DEVICE, JOINTS, SixCounts
from palpate.drivers.zebra_zero.faults import TRIPPED, ArmFaultError, FaultKind, fault_in
from palpate.drivers.zebra_zero.settings import STOP_TIMEOUT_S, Streaming, ZebraZeroSettings
from palpate.drivers.zebra_zero.tracking import Rounds, Tracking


class CountsStore(Protocol):
    """Storage for the counters between runs."""

    def load(self) -> Sequence[int] | None:
        """Return the counters of an earlier run, or None if there are none.

        Raises:
            WiringError: The counters cannot be read.
        """

    def save(self, counts: SixCounts) -> None:
        """Store the counters; never raises."""


class ZebraZero(LatchingArm):
    """A Zebra Zero arm on an open port.

    Args:
        at_home: A person's confirmation that the arm is in its home pose whenever its controller is switched on.

    Attributes:
        streaming: Method for sending set-points to the modules.
        stopped: Result of the last stop; None if there has been none since the arm was enabled.
    """

    def __init__(
        self,
        stream: ByteStream,
        clock_ns: Callable[[], int],
        sleep_s: Callable[[float], None],
        settings: ZebraZeroSettings,
        *,
        at_home: bool = False,
        store: CountsStore | None = None,
    ) -> None:
        super().__init__()
        self._at_home, self._store = at_home, store
        self.settings = settings
        self._clock_ns = clock_ns
        self._bus = NmcBus(stream, clock_ns, sleep_s, self.settings.bus)
        self._servos = servos.Servos(self._bus, self.settings)
        self._tracking, self._stepped_ns = Tracking(self.settings), 0
        self._rounds = Rounds(self._bus, self._servos, self._tracking, self.settings, clock_ns)
        self.modules: tuple[Module, ...] = ()
        self.streaming = Streaming.STOP_HERE
        self.stopped: servos.StopOutcome | None = None
        self._power_lost = False

    def open(self) -> None:
        """Find six servo modules; take the arm's position from stored counters or a person's confirmation.

        Modules that still have their addresses are taken over unchanged; others are reset, with motors off and counters
        at zero. The encoders have no index for homing (FACT: the port), so only a person can confirm the position.
        """
        self._require("open()", ArmState.NEW)
        found = self._servos.attach()
        self.modules = servos.check_modules(start(self._bus) if found is None else found)
        self.streaming = servos.streaming_for(self.modules)
        self._tracking.begin_at(self._servos.meet())
        stored = None if self._store is None else self._store.load()
        if found is None or stored is None:
            self._confirm_home(was_reset=found is None)
        elif not self._tracking.agrees(stored):
            problem = f"counters at {self._tracking.counts}, stored were {tuple(stored)}"
            raise WiringError(DEVICE, problem, servos.GO_HOME)
        self._state = ArmState.CONFIGURED

    def _confirm_home(self, *, was_reset: bool) -> None:
        if not was_reset:
            problem = "the modules have been on since an earlier run, so the arm need not be in its home pose any more"
            raise StateError(DEVICE, problem, f"keep the counters in counts_file, or {servos.GO_HOME}")
        if self._at_home is not True:
            problem = "the encoders tell angles only from the pose in which they were set to zero"
            raise StateError(DEVICE, problem, "see that the arm rests in its home pose and confirm with at_home=True")
        self._servos.zero()
        self._tracking.begin_at((0, 0, 0, 0, 0, 0))

    def enable(self) -> None:
        """Engage every servo to hold its motor in its current position."""
        self._require("enable()", ArmState.CONFIGURED)
        self.stopped = None
        with self._latching():
            counts, fault = self._servos.check()
            self._tracking.begin_at(counts)
            _raise(fault or self._rounds.beyond_limits())
            for axis in servos.AXES:
                _raise(self._servos.enable(axis))
        self.setpoint_rad = self._tracking.position_rad
        # The first step may take a whole period.
        self._stepped_ns = self._clock_ns() - round(1e9 / self.settings.rate_Hz)
        self._state = ArmState.ENABLED

    def cycle(self, setpoint_rad: Sequence[float] | None = None, /) -> Measured:
        """Send any set-point and return the pose measured before it takes effect, in one exchange with every axis.

        Call it at ``settings.rate_Hz``; an earlier call shortens the step in proportion.

        Args:
            setpoint_rad: Requested joint angles, (6,); None holds the pose.
        """
        self._require("cycle()", ArmState.CONFIGURED, ArmState.ENABLED, ArmState.STOPPED)
        begin_ns = self._clock_ns()
        commands = self._plan(setpoint_rad, begin_ns)
        with self._latching():
            self._rounds.run(commands)
        return Measured(self._tracking.position_rad, (begin_ns + self._clock_ns()) // 2)

    @override
    def diagnostics(self) -> dict[str, str]:
        kinds = sorted({module.identity.name for module in self.modules})
        found = super().diagnostics()
        shown = self._shown()
        return {
            "state": found["state"],
            "fault": found["fault"] or ("" if shown is None else str(shown)),
            "modules": f"{len(self.modules)}, {'; '.join(kinds)}",
            "line": f"{self._bus.line.baud} baud, set-points {self.streaming.value}",
            "highest rate": f"{self.settings.highest_rate_Hz:.1f} Hz, computed",
            "exchanges": f"{self._bus.exchanges}, errors: {listed(self._bus.errors) or 'none'}",
            "counters": "not kept: set counts_file to keep them" if self._store is None else "kept in a file",
        }

    def stop(self) -> None:
        """Stop and hold every motor whose servo is on, and store its counters; a dead line is not tried again."""
        if self._state in (ArmState.NEW, ArmState.CLOSED):
            return
        if self._state is ArmState.ENABLED:
            self._state = ArmState.STOPPED
        if self.stopped not in (servos.StopOutcome.STATIONARY, servos.StopOutcome.LINE_DEAD):
            self._halt()
        if self._power_lost:
            # Nothing holds the arm anyway, and when power returns it must not be pulled to an old set-point.
            self._power_lost = False
            with suppress(DriverError):
                self._servos.off()
        if self._store is not None:
            self._store.save(self._tracking.counts)

    def _halt(self) -> None:
        on = sorted(self._servos.on)
        self.stopped = servos.bring_to_rest(self._bus, on, STOP_TIMEOUT_S, self._clock_ns, are_all=len(on) == JOINTS)
        if self.stopped is servos.StopOutcome.STATIONARY:
            self._rounds.look_once()
        elif self.fault is None and self.stopped is servos.StopOutcome.LINE_DEAD:
            self._fail(SilentError(DEVICE, self.stopped.value, "check cable and supply, then acknowledge"))
        elif self.fault is None and self.stopped is servos.StopOutcome.NOT_SEEN:
            self._fail(
                DeviceFaultError(DEVICE, self.stopped.value, "check that the arm is stationary, then acknowledge")
            )

    def acknowledge(self) -> None:
        """Clear a latched fault and the modules' sticky bits. Only a person may decide to do this.

        Modules that answer at their addresses were not reset, so their counters are valid. The fault remains until all
        modules answer. After a reset of modules, close the arm instead.
        """
        self._require_fault()
        if self._servos.attach() is None:
            problem = "no module answers at its address, so the position of the arm is not known any more"
            remedy = f"fix cable or supply and acknowledge again; if they were reset, {servos.GO_HOME}"
            raise WiringError(DEVICE, problem, remedy)
        self._tracking.begin_at(self._servos.meet())
        remaining = self._servos.clear()
        self.stopped = None
        if remaining is not None:
            self.fault = str(remaining)
            raise remaining
        self._state, self.fault = ArmState.CONFIGURED, None

    def close(self) -> None:
        """Stop the arm; its servos continue to hold it. May be called at any time and repeatedly; never raises."""
        # Store the counters again: those stored as the motors stopped were read while the arm was still swinging.
        self.stop()
        self._state = ArmState.CLOSED

    def _shown(self) -> ArmFaultError | None:
        """Return the fault in the latest replies, whether or not the servos are on."""
        for axis, reply in self._tracking.replies.items():
            if self.settings.require_power and not reply.status & NmcStatus.POWER_ON:
                return ArmFaultError(FaultKind.POWER_LOST, axis)
            is_on = bool(reply.aux and reply.aux & Aux.SERVO_ON)
            if (fault := fault_in(axis, reply, self.settings, should_be_on=is_on)) is not None:
                return fault
        return self._rounds.beyond_limits()

    def _plan(self, requested_rad: Sequence[float] | None, now_ns: int) -> tuple[NmcCommand, ...]:
        if requested_rad is not None:
            self._require("a set-point", ArmState.ENABLED, ArmState.STOPPED)
            require_angles(requested_rad, JOINTS)
        if requested_rad is None or self._state is not ArmState.ENABLED:
            return (NOP,) * JOINTS
        limits = self.settings.limits
        # At most one period counts, so a late cycle is not allowed a longer step.
        step_s = min((now_ns - self._stepped_ns) * 1e-9, 1.0 / self.settings.rate_Hz)
        within = clamped(requested_rad, limits.lower_rad, limits.upper_rad)
        self.setpoint_rad = held_back(within, self.setpoint_rad, [limits.velocity_rad_per_s * step_s] * JOINTS)
        self._stepped_ns = now_ns
        counts = self.settings.transmission.to_counts(self.setpoint_rad)
        return tuple(servos.setpoint(self.streaming, count) for count in counts)

    def _fail(self, error: DriverError) -> None:
        super()._fail(error)
        if isinstance(error, ArmFaultError):
            self._power_lost = error.kind is FaultKind.POWER_LOST
            if error.kind in TRIPPED and error.axis is not None:
                self._servos.on.discard(error.axis)


def _raise(fault: ArmFaultError | None) -> None:
    if fault is not None:
        raise fault
