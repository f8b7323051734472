"""Polled communication with the board, without threads, clocks or waits."""

from collections import Counter
from collections.abc import Callable, Collection
from typing import Final

from typing_extensions import override

from palpate.drivers.can import CanLink
from palpate.drivers.device import ForceSample, PolledSensor, listed
from palpate.drivers.errors import DeviceFaultError, DriverError, SilentError, StateError, WiringError
from palpate.drivers.jr3.codec import CanDecoder, encode_can
from palpate.drivers.jr3.messages import LEFT_HANDED, Ack, FullScales, Op, Reading, Signs
from palpate.drivers.jr3.phases import FLOWING, READABLE, REQUESTS, TRANSITIONS, Jr3Event, Jr3Phase, RequestInFlight
from palpate.drivers.jr3.sampling import RESTARTED, Sampler

FIRST_READING_NS: Final = 500_000_000
"""Maximum wait for the first reading after START, in ns. Assumed."""
_STALL_PERIODS: Final = 20
"""Number of periods without a new reading after which the sensor counts as silent. Assumed."""
ACK_TIMEOUT_NS: Final = 250_000_000
ATTEMPTS: Final = 3
PING_ATTEMPTS: Final = 16
"""Number of attempts for the first request. FACT: yarp-devices waits 0.25 s for a reply; the board boots in 2 s."""
_REMEDY: Final = "check power, wiring, bit rate and termination, and that the sensor is plugged into its board"


class Jr3(PolledSensor):
    """A JR3 sensor with its board.

    The driver does not tare the sensor, and starting the stream removes a zero offset that another client has set.
    (FACT: revisions of Jr3Controller.cpp up to 765f784 zero the sensor at every START. No host can prevent that; a
    sensor that carries a tool and reads zero right after :meth:`open` has such firmware.)

    Args:
        cutoff_Hz: Cut-off frequency for the board's first-order low-pass filter, up to 655.35; 0 for no filter.
        period_us: Time between readings, in microseconds.

    Attributes:
        after_boot: True if the board restarted during a run; kept until acknowledged.
    """

    def __init__(
        self, link: CanLink, node: int, *, cutoff_Hz: float, period_us: int, signs: Signs = LEFT_HANDED
    ) -> None:
        super().__init__(f"JR3 on CAN, node {node}", _REMEDY)
        self.phase = Jr3Phase.CLOSED
        self.after_boot = False
        self._link, self._node, self._exchange = link, node, RequestInFlight()
        self._cutoff_cHz, self._period_us = round(cutoff_Hz * 100.0), period_us
        self._decoder = CanDecoder(node, self.errors)
        self._sampler = Sampler(self._cutoff_cHz, signs, self.errors)
        self._heard = self._started = False
        self._fences = self._boots = 0
        self._raw_scales: tuple[int, ...] = ()

    @property
    def full_scales(self) -> FullScales:
        """The board's full-scale ranges, which identify it. FACT: the protocol has no serial number or version.

        Raises:
            StateError: The full-scale ranges have not been read yet.
        """
        if self._sampler.full_scales is None:
            raise StateError(self.name, "has not been asked yet", "open it and poll first")
        return self._sampler.full_scales

    def open(self) -> None:
        """Start the communication, which :meth:`poll` continues. Also used to leave FAULTED and SILENT.

        Raises:
            StateError: The sensor is already open.
        """
        self._wish(Jr3Event.OPEN_REQUESTED)
        self.failure, self._heard, self._started = None, False, False
        self._fences = ATTEMPTS
        self._decoder.forget()

    def stop(self) -> None:
        """Stop the stream; poll until ``phase`` is CLOSED. Raises StateError if the sensor is already closed."""
        self._wish(Jr3Event.STOP_REQUESTED)

    def acknowledge(self) -> None:
        """Acknowledge a restart of the board, which is then no longer reported."""
        self.after_boot = False

    @override
    def check(self) -> None:
        if self.failure is not None:
            raise self.failure
        if self.phase is Jr3Phase.SILENT:
            raise self.silence(self._polled_ns)

    @override
    def poll(self, now_ns: int) -> list[ForceSample]:
        samples: list[ForceSample] = []
        self._polled_ns = now_ns
        if self.phase in (Jr3Phase.CLOSED, Jr3Phase.FAULTED):
            return samples
        try:
            for frame in self._link.receive():
                message = self._decoder.decode(frame)
                if isinstance(message, Reading):
                    sample = self._read(message, now_ns)
                    if sample is not None:
                        samples.append(sample)
                elif isinstance(message, Ack):
                    self._answered(message, now_ns)
                elif message is not None:
                    self._booted()
            self._do_due(now_ns)
        except DriverError as error:
            self._fail(error, Jr3Event.LINK_LOST)
        if samples:
            self._is_news()
        return samples

    @override
    def diagnostics(self) -> dict[str, str]:
        found = super().diagnostics()
        found["board"] = f"{self.name}, filter {self._cutoff_cHz / 100:g} Hz, every {self._period_us} us"
        found["readings"] = f"{self._sampler.samples}"
        found["wire"] = f"{self._link.garbled} frames of another kind, {self._link.bus_offs} bus-offs"
        found["restarts"] = f"{self._boots + self.errors[RESTARTED]}"
        return found

    def _wish(self, cue: Jr3Event) -> None:
        if not self._advance(cue):
            problem = f"cannot be {cue.value} while {self.phase.value}"
            raise StateError(self.name, problem, "poll it until it is in another phase")

    def _advance(self, cue: Jr3Event) -> bool:
        after = TRANSITIONS.get((self.phase, cue))
        if after is None:
            return False
        self.phase = after
        self._exchange.cancel()
        if after in REQUESTS:
            self._ask(REQUESTS[after])
        elif after is Jr3Phase.READING_SCALES:
            self._raw_scales = ()
            self._ask(Op.GET_FORCE_SCALES)
        return True

    def _ask(self, op: Op) -> None:
        attempts = PING_ATTEMPTS if self.phase is Jr3Phase.PINGING else ATTEMPTS
        if self.phase is Jr3Phase.READING_SCALES:
            # The request is not simply repeated: replies for forces and moments look alike, so a late reply could be
            # mistaken for the other. The state is requested first; its short reply cannot overtake a late long one.
            attempts = 1
        self._exchange.begin(op, attempts, ACK_TIMEOUT_NS)

    def _answered(self, ack: Ack, now_ns: int) -> None:
        self._heard = True
        if self._exchange.answer(ack) is None:
            return
        if self.phase is Jr3Phase.READING_SCALES:
            self._scales_read(ack.scales)
            return
        if self.phase is Jr3Phase.STARTING:
            self._started = True
            self._sampler.started(now_ns)
        self._advance(Jr3Event.DONE)

    def _scales_read(self, scales: tuple[int, ...]) -> None:
        self._raw_scales += scales
        if len(self._raw_scales) < 6:
            self._ask(Op.GET_MOMENT_SCALES)
            return
        fx, fy, fz, mx, my, mz = self._raw_scales
        self._sampler.full_scales = FullScales((fx, fy, fz), (mx, my, mz))
        self._advance(Jr3Event.DONE)

    def _booted(self) -> None:
        self._heard = True
        self._boots += 1
        self._decoder.forget()
        self.after_boot |= self._started
        if self._advance(Jr3Event.BOOTED):
            self._fences = ATTEMPTS

    def _read(self, reading: Reading, now_ns: int) -> ForceSample | None:
        if self.phase not in READABLE:
            return None
        sample = self._sampler.take(reading, now_ns)
        if sample is not None:
            self.latest = sample
            if self.phase in (Jr3Phase.AWAITING, Jr3Phase.SILENT):
                self._advance(Jr3Event.READ)
        return sample

    def _do_due(self, now_ns: int) -> None:
        timeout_ns = _STALL_PERIODS * self._period_us * 1000
        if self.phase is Jr3Phase.AWAITING:
            timeout_ns = max(timeout_ns, FIRST_READING_NS)
        if self.phase in FLOWING and now_ns - self._sampler.last_new_ns > timeout_ns:
            self._decoder.forget()
            self._advance(Jr3Event.STALLED)
        if self._exchange.exhausted(now_ns):
            self._give_up()
        request = self._exchange.request
        if request is not None and self._exchange.due(now_ns):
            self._link.send(encode_can(request, self._node, self._cutoff_cHz, self._period_us))

    def _give_up(self) -> None:
        if self.phase is Jr3Phase.READING_SCALES and self._fences > 0:
            self._fences -= 1
            self._advance(Jr3Event.RETRIED)
        elif self.phase is Jr3Phase.LEAVING:
            self._advance(Jr3Event.GAVE_UP)
        else:
            self._fail(self._no_answer())

    def _no_answer(self) -> DriverError:
        if self._exchange.refused:
            remedy = "check the cable between sensor and board, then power the board again"
            return DeviceFaultError(self.name, "the board says that its sensor is not initialised", remedy)
        if self._heard:
            return SilentError(self.name, f"no answer while {self.phase.value}", _REMEDY)
        came = listed(self.errors + Counter({"frames of another kind": self._link.garbled}))
        return WiringError(self.name, f"no answer ({came or 'no frames'})", f"{_REMEDY}; check its node number")

    def _fail(self, error: DriverError, cue: Jr3Event = Jr3Event.GAVE_UP) -> None:
        if self._advance(cue):
            self.failure = error


_INTERVAL_S: Final = 0.002


def start_up(device: Jr3, clock_ns: Callable[[], int], sleep: Callable[[float], None], timeout_s: float = 30.0) -> None:
    """Open a closed, silent or faulted sensor and wait until it streams.

    Raises:
        DriverError: The sensor does not stream; the error's class indicates why.
    """
    device.open()
    _wait(device, clock_ns, sleep, {Jr3Phase.STREAMING}, timeout_s)


def shut_down(
    device: Jr3, clock_ns: Callable[[], int], sleep: Callable[[float], None], timeout_s: float = 10.0
) -> None:
    """Stop the stream and wait for the board's reply or a time-out; has no effect if the sensor is closed."""
    if device.phase is not Jr3Phase.CLOSED:
        device.stop()
        _wait(device, clock_ns, sleep, {Jr3Phase.CLOSED, Jr3Phase.FAULTED}, timeout_s)


def _wait(
    device: Jr3,
    clock_ns: Callable[[], int],
    sleep: Callable[[float], None],
    goals: Collection[Jr3Phase],
    timeout_s: float,
) -> None:
    deadline_ns = clock_ns() + round(timeout_s * 1e9)
    while True:
        now_ns = clock_ns()
        device.poll(now_ns)
        if device.phase in goals:
            return
        device.check()
        if now_ns >= deadline_ns:
            problem = f"still {device.phase.value} after {timeout_s:g} s"
            raise SilentError("JR3", problem, "check cable and power, or wait longer")
        sleep(_INTERVAL_S)
