"""The arm: connect, confirm where it is, switch on, run cycles, stop. No threads; the caller's loop is the only one."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Final, NoReturn, Protocol, Self

from typing_extensions import override

from palpate.drivers.device import Applied, AppliedReason, ArmDriver, listed
from palpate.drivers.errors import DeviceFaultError, DriverError, StateError, WiringError
from palpate.drivers.nmc import NOP, Aux, Module, NmcBus, NmcCommand, NmcStatus, start
from palpate.drivers.serial_port import ByteStream
from palpate.drivers.zebra_zero.codec import DEVICE, JOINTS, SixCounts, six
from palpate.drivers.zebra_zero.servos import (
    AXES,
    GO_HOME,
    Servos,
    StopOutcome,
    bring_to_rest,
    check_modules,
    setpoint,
    streaming_for,
)
from palpate.drivers.zebra_zero.settings import Streaming, ZebraZeroSettings
from palpate.drivers.zebra_zero.states import Fault, FaultKind, ZebraEvent, ZebraMeasured, ZebraState, after, fault_in
from palpate.drivers.zebra_zero.tracking import Rounds, Setpoints, Tracking, Trouble, lost

_CYCLING: Final = (ZebraState.HOMED, ZebraState.SERVO_ON, ZebraState.STOPPED)
_TRIPPED: Final = (FaultKind.POSITION_ERROR, FaultKind.OVERCURRENT, FaultKind.SERVO_OFF)
"""Faults by which the firmware has switched a motor off; a stop must not switch it on again."""


class CountsStore(Protocol):
    """Keeps the counters from run to run."""

    def load(self) -> Sequence[int] | None:
        """The counters that an earlier run left; None when there are none.

        Raises:
            WiringError: They cannot be read.
        """

    def save(self, counts: SixCounts) -> None:
        """Keep the counters; never raises."""


class ZebraZero(ArmDriver):
    """The arm on an open port. As a context manager it is closed, and so stopped, on every way out.

    Not thread-safe.

    Args:
        stream: The open port, 8N1; the caller closes it after the arm.
        clock_ns: Monotonic clock, ns.
        at_home: A person's word that the arm rests in its home pose whenever its controller was switched on.
        store: Keeps the counters from run to run; None keeps them nowhere.

    Attributes:
        fault: The latched fault, or None.
        modules: Those of the last :meth:`connect`, in the order of the chain.
        streaming: How set-points reach them.
        was_reset: Whether the modules came out of a reset at the last :meth:`connect`: only then can home be confirmed.
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
        self._at_home, self._store = at_home, store
        self.settings = settings
        self._clock_ns = clock_ns
        self._bus = NmcBus(stream, clock_ns, sleep_s, self.settings.bus)
        self._servos = Servos(self._bus, self.settings)
        self._tracking, self._setpoints = Tracking(self.settings), Setpoints(self.settings)
        self._rounds = Rounds(self._bus, self._servos, self._tracking, self.settings, clock_ns)
        self.state = ZebraState.CLOSED
        self.fault: Fault | None = None
        self.modules: tuple[Module, ...] = ()
        self.streaming = Streaming.STOP_HERE
        self.was_reset = self._is_referenced = False
        self._stopped: StopOutcome | None = None

    @property
    @override
    def is_faulted(self) -> bool:
        return self.fault is not None

    @property
    def keeps_counts(self) -> bool:
        """Whether the counters are kept from run to run."""
        return self._store is not None

    @property
    def stored_counts(self) -> SixCounts | None:
        """Newest counter values, to be kept for :meth:`resume`; None when they mean nothing."""
        return self._tracking.counts if self._is_referenced else None

    @property
    def baud(self) -> int:
        """Rate of the line now, bit/s."""
        return self._bus.line.baud

    def open(self) -> None:
        """Finds the modules, and takes the arm's position from the stored counters, or from a person's word.

        Raises:
            StateError: Nobody confirms that the arm is at home.
            DriverError: As :meth:`connect`, or the stored counters do not fit.
        """
        if self.state is ZebraState.CLOSED:
            self.connect()
        stored = None if self._store is None else self._store.load()
        if self.was_reset or stored is None:
            self.confirm_home(at_home=self._at_home)
        else:
            self.resume(stored)

    def connect(self, *, reset: bool = False) -> None:
        """Finds six servo modules; takes them over as they are if they still have their addresses, or resets them.

        Args:
            reset: Reset them in any case: all motors go off, and all counters to zero.

        Raises:
            StateError: Already connected.
            WiringError: Nobody answers, or not six servo modules, or at another baud rate.
            SilentError, GarbledError: Some answer and some do not; only nonsense; the port is gone.
        """
        connected = after(self.state, ZebraEvent.CONNECT)
        self._is_referenced = False
        found = None if reset else self._servos.attach()
        self.was_reset = found is None
        self.modules = check_modules(start(self._bus) if found is None else found)
        self.streaming = streaming_for(self.modules, self.settings)
        self._tracking.begin_at(self._servos.meet())
        self.state, self.fault = connected, None

    def confirm_home(self, *, at_home: bool) -> None:
        """Takes a person's word that the arm rests in its home pose: motors off, counters to zero.

        There is no index to home to (FACT: the port), so nothing but a person can know.

        Raises:
            StateError: Out of order, nobody confirms, or the modules were not reset.
            DriverError: The bus failed.
        """
        homed = after(self.state, ZebraEvent.REFERENCE)
        if not self.was_reset:
            problem = "the modules have been on since an earlier run, so the arm need not be in its home pose any more"
            remedy = "resume with that run's counters, or switch the controller off and on with the arm at home"
            raise StateError(DEVICE, problem, remedy)
        if at_home is not True:
            problem = "the encoders tell angles only from the pose in which they were set to zero"
            raise StateError(DEVICE, problem, "see that the arm rests in its home pose and confirm with at_home=True")
        self._servos.zero()
        self._tracking.begin_at((0, 0, 0, 0, 0, 0))
        self.state, self._is_referenced = homed, True

    def resume(self, stored_counts: Sequence[int]) -> None:
        """Takes the counters as they are, because they are where an earlier run has left them.

        Args:
            stored_counts: ``stored_counts`` of that run, (6,).

        Raises:
            StateError: Out of order.
            WiringError: The modules have been reset since, or the counters are elsewhere.
        """
        homed = after(self.state, ZebraEvent.REFERENCE)
        if self.was_reset:
            raise WiringError(DEVICE, "the modules have been reset, so stored counters mean nothing", GO_HOME)
        if not self._tracking.agrees(stored_counts):
            problem = f"counters at {self._tracking.counts}, stored were {tuple(stored_counts)}"
            raise WiringError(DEVICE, problem, GO_HOME)
        self.state, self._is_referenced = homed, True

    def enable(self) -> None:
        """Lets every servo hold its motor where it stands; nothing moves."""
        enabled = after(self.state, ZebraEvent.ENABLE)
        self._stopped = None
        try:
            counts, fault = self._servos.check()
            self._tracking.begin_at(counts)
            self._check(fault or self._rounds.beyond_limits())
            for axis in AXES:
                self._check(self._servos.enable(axis))
        except DeviceFaultError:
            raise
        except DriverError as error:
            self._fail(lost(error))
        self._setpoints.begin_at(self._tracking.position_rad, self._clock_ns())
        self.state = enabled

    def preview(self, setpoint_rad: Sequence[float], /) -> Applied:
        """What a cycle that is on time would make of the set-point now; sends nothing."""
        return self._setpoints.preview(setpoint_rad) if self.state is ZebraState.SERVO_ON else self._held(setpoint_rad)

    def cycle(self, setpoint_rad: Sequence[float] | None = None, /) -> ZebraMeasured:
        """Hands out the set-point, if any, and brings back the pose from before it: one exchange with every axis.

        Call it at ``settings.rate_Hz``; called sooner, it shortens the step in proportion.

        Args:
            setpoint_rad: Wanted joint angles, (6,); None: hold.
        """
        if self.fault is not None:
            raise self.fault.error()
        if self.state not in _CYCLING or (setpoint_rad is not None and self.state is ZebraState.HOMED):
            raise StateError(DEVICE, f"cannot run a cycle while {self.state.value}", "home, and switch the servos on")
        begin_ns = self._clock_ns()
        applied, commands = self._plan(setpoint_rad, begin_ns)
        is_fresh, trouble = self._rounds.run(commands)
        if trouble is not None:
            self._fail(trouble)
        return self._tracking.measured(is_fresh, applied, begin_ns, self._clock_ns())

    @override
    def diagnostics(self) -> dict[str, str]:
        kinds = sorted({module.identity.name for module in self.modules})
        fault = self.fault or self._shown()
        return {
            "state": self.state.value,
            "fault": "" if fault is None else str(fault.error()),
            "modules": f"{len(self.modules)}, {'; '.join(kinds)}",
            "line": f"{self.baud} baud, set-points {self.streaming.value}",
            "highest rate": f"{self.settings.budget().max_rate_Hz:.1f} Hz, computed",
            "exchanges": f"{self._bus.exchanges}, errors: {listed(self._bus.errors) or 'none'}",
            "counters": "kept in a file" if self.keeps_counts else "not kept: set counts_file to keep them",
        }

    def smooth_stop(self) -> StopOutcome:
        """Brings every motor whose servo is on to rest and keeps it there. Any time, twice too; never raises.

        Nothing moves after a stop until the servos are switched on anew, and a dead line is not tried again: only a
        stop that was not seen to succeed is repeated.
        """
        if self._stopped in (StopOutcome.AT_REST, StopOutcome.LINE_DEAD):
            return self._stopped
        if self.state is ZebraState.SERVO_ON:
            self.state = after(self.state, ZebraEvent.STOP)
        on = sorted(self._servos.on)
        outcome = bring_to_rest(self._bus, on, self.settings.stop_timeout_s, self._clock_ns, are_all=len(on) == JOINTS)
        if outcome is StopOutcome.LINE_DEAD:
            self._latch(Fault(FaultKind.COMMUNICATION, None, outcome.value))
        elif outcome is StopOutcome.NOT_SEEN:
            self._latch(Fault(FaultKind.STOP_NOT_SEEN))
        elif outcome is StopOutcome.AT_REST:
            self._rounds.look_once()
        if self.state is ZebraState.STOPPING:
            self.state = after(self.state, ZebraEvent.AT_REST)
        self._stopped = outcome
        return outcome

    def stop(self) -> None:
        """Brings the arm to rest and keeps its counters."""
        if self.state is not ZebraState.CLOSED:
            self.smooth_stop()
            if self._store is not None and (counts := self.stored_counts) is not None:
                self._store.save(counts)

    def disable(self) -> None:
        """The servos go on holding the arm; :meth:`release` switches them off."""

    def release(self) -> None:
        """Stops, then switches every motor off; nothing holds the arm then. Also possible while faulted.

        Raises:
            StateError: Not connected.
            SilentError: A motor did not confirm.
        """
        if self.state is ZebraState.CLOSED:
            raise StateError(DEVICE, "cannot release the motors while closed", "connect first")
        self.smooth_stop()
        self._servos.off()
        if self.state is ZebraState.STOPPED:
            self.state = after(self.state, ZebraEvent.RELEASE)

    def acknowledge(self) -> None:
        """Clears a latched fault and the modules' sticky bits: a person's decision.

        Leads to STOPPED. Modules that have kept their addresses were not reset, so their counters hold; until they all
        answer there the fault stays, and where they were reset, closing leads on.

        Raises:
            StateError: There is no fault.
            WiringError: No module answers at its address, or the position was never known.
            SilentError, GarbledError: Not all of them answer, or not with sense.
            DeviceFaultError: A fault is still there; it stays latched.
        """
        acknowledged = after(self.state, ZebraEvent.ACKNOWLEDGE)
        if not self._is_referenced or self._servos.attach() is None:
            problem = "no module answers at its address, so the position of the arm is not known any more"
            remedy = f"mend cable or supply and acknowledge again; if they were reset, close it and {GO_HOME}"
            raise WiringError(DEVICE, problem, remedy)
        self._tracking.begin_at(self._servos.meet())
        remaining = self._servos.clear()
        self._stopped = None
        if remaining is not None:
            self.fault = remaining
            raise remaining.error()
        self.state, self.fault = acknowledged, None

    def close(self) -> None:
        """Stops and releases the arm; its servos go on holding it. Any time, twice too; never raises."""
        # Once more: what was kept as the motors stopped was read while the arm still swung.
        self.stop()
        self._servos.on.clear()
        self._stopped = None
        self.state, self.fault = after(self.state, ZebraEvent.CLOSE), None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _shown(self) -> Fault | None:
        """The fault that the newest replies show, whether or not the servos are on."""
        for axis, reply in self._tracking.replies.items():
            if self.settings.require_power and not reply.status & NmcStatus.POWER_ON:
                return Fault(FaultKind.POWER_LOST, axis)
            is_on = bool(reply.aux and reply.aux & Aux.SERVO_ON)
            if (fault := fault_in(axis, reply, self.settings, should_be_on=is_on)) is not None:
                return fault
        return self._rounds.beyond_limits()

    def _held(self, asked_rad: Sequence[float]) -> Applied:
        six(asked_rad)
        return Applied(self._tracking.position_rad, AppliedReason.STOPPED)

    def _plan(self, asked_rad: Sequence[float] | None, now_ns: int) -> tuple[Applied | None, tuple[NmcCommand, ...]]:
        if asked_rad is None or self.state is not ZebraState.SERVO_ON:
            self._setpoints.hold()
            return None if asked_rad is None else self._held(asked_rad), (NOP,) * JOINTS
        applied = self._setpoints.advance(asked_rad, now_ns)
        counts = self.settings.transmission.to_counts(applied.position_rad)
        return applied, tuple(setpoint(self.streaming, count) for count in counts)

    def _check(self, fault: Fault | None) -> None:
        if fault is not None:
            self._fail(Trouble(fault, fault.error()))

    def _fail(self, trouble: Trouble) -> NoReturn:
        fault = trouble.fault
        self._latch(fault)
        if fault.kind in _TRIPPED and fault.axis is not None:
            self._servos.on.discard(fault.axis)
        self.smooth_stop()
        if fault.kind is FaultKind.POWER_LOST:
            # Nothing holds the arm anyway, and a supply that comes back must not pull it to an old set-point.
            with suppress(DriverError):
                self._servos.off()
        raise trouble.error

    def _latch(self, fault: Fault) -> None:
        if self.fault is None and self.state is not ZebraState.CLOSED:
            self.fault, self.state = fault, after(self.state, ZebraEvent.FAULT)
