"""The conversation with the board, advanced by polling: no thread, no clock, no waiting."""

from collections import Counter
from collections.abc import Callable, Collection
from typing import Final

from typing_extensions import override

from palpate.drivers.device import PolledSensor
from palpate.drivers.errors import DriverError, SettingError, SilentError, StateError
from palpate.drivers.jr3 import health
from palpate.drivers.jr3.messages import Ack, FullScales, Jr3Sample, Op, Reading, Request
from palpate.drivers.jr3.phases import FLOWING, READABLE, REQUESTS, TRANSITIONS, Jr3Event, Jr3Phase, RequestInFlight
from palpate.drivers.jr3.sampling import Sampler
from palpate.drivers.jr3.settings import Jr3Settings, settling_ns
from palpate.drivers.jr3.transport import ACK_TIMEOUT_NS, ATTEMPTS, MIN_PERIOD_US, PING_ATTEMPTS, CanTransport

FIRST_READING_NS = 500_000_000
"""Longest wait for the first reading after START, in ns. Assumed."""

MAX_BOOTS = 5
"""Restarts in a row, without a reading between them, that are no fault. Assumed."""


class Jr3(PolledSensor):
    """One JR3 behind one board.

    Nothing here tares, and starting the stream removes a zero that another client has set. (FACT: revisions of
    Jr3Controller.cpp up to 765f784 zero at every START. No host can prevent that; a sensor that carries a tool and
    reads zero right after :meth:`open` has such firmware.)

    Raises:
        SettingError: The wire cannot carry as many readings.
    """

    def __init__(self, wire: CanTransport, settings: Jr3Settings | None = None) -> None:
        self._settings = settings = Jr3Settings() if settings is None else settings
        if settings.period_us < MIN_PERIOD_US:
            problem = f"{settings.period_us} us between readings is too short"
            raise SettingError(wire.name, problem, f"choose {MIN_PERIOD_US} us or more on this wire")
        super().__init__()
        self.phase = Jr3Phase.CLOSED
        self._wire, self._exchange = wire, RequestInFlight()
        self._cutoff_cHz, self._period_us = settings.cutoff_cHz, settings.period_us
        self._settling_ns = settling_ns(self._cutoff_cHz)
        self._sampler = Sampler(self._period_us, self._settling_ns, settings.signs)
        self._heard = self._started = False
        self._fences = self._boots = self._boots_in_row = 0
        self._raw_scales: tuple[int, ...] = ()

    @property
    def after_boot(self) -> bool:
        """Whether the board restarted in mid-run. Until acknowledged."""
        return self._sampler.after_boot

    @property
    def was_zeroed(self) -> bool:
        """Whether another client has set its zero in mid-run, as far as that shows. Until acknowledged."""
        return self._sampler.was_zeroed

    @property
    def full_scales(self) -> FullScales:
        """All by which a board can be told from another. FACT: the protocol has neither serial number nor version.

        Raises:
            StateError: They have not been read yet.
        """
        if self._sampler.full_scales is None:
            raise StateError(self._wire.name, "has not been asked yet", "open it and poll first")
        return self._sampler.full_scales

    def open(self) -> None:
        """Begin to talk; :meth:`poll` does the rest. Also the way out of FAULTED and SILENT.

        Raises:
            StateError: It is open already.
        """
        self._wish(Jr3Event.ASKED_TO_OPEN)
        self.failure, self._heard, self._started = None, False, False
        self._fences, self._boots_in_row = ATTEMPTS, 0
        self._wire.forget()

    def stop(self) -> None:
        """Stop the stream; poll until ``phase`` is CLOSED. StateError when it is closed."""
        self._wish(Jr3Event.ASKED_TO_STOP)

    @override
    def acknowledge(self) -> None:
        """Say that a restart of the board, or the zero of another client, has been seen; it is no longer reported."""
        self._sampler.after_boot = self._sampler.was_zeroed = False

    def check(self) -> None:
        """Raise what is wrong now."""
        if self.failure is not None:
            raise self.failure
        if self.phase is Jr3Phase.SILENT:
            raise self.silence(self._polled_ns)

    @override
    def silence(self, now_ns: int) -> SilentError:
        return health.no_reading(self._wire.name, now_ns - self._sampler.last_new_ns, self._came())

    @override
    def poll(self, now_ns: int) -> list[Jr3Sample]:
        """Take what has arrived, and do what is due."""
        samples: list[Jr3Sample] = []
        self._polled_ns = now_ns
        if self.phase in (Jr3Phase.CLOSED, Jr3Phase.FAULTED):
            return samples
        try:
            for message in self._wire.receive():
                if isinstance(message, Reading):
                    sample = self._read(message, now_ns)
                    if sample is not None:
                        samples.append(sample)
                elif isinstance(message, Ack):
                    self._answered(message, now_ns)
                else:
                    self._booted()
            self._do_due(now_ns)
        except DriverError as error:
            self._fail(error, Jr3Event.LINK_LOST)
        self._count()
        if samples:
            self._is_news()
        return samples

    def _count(self) -> None:
        wire, sampler, counter = self._wire.counts(), self._sampler, self._sampler.counter
        counts = (
            counter.duplicates + wire.duplicates, wire.garbage, wire.orphans, counter.doubted, counter.restarts,
            sampler.full, self._exchange.strays,
        )  # fmt: skip
        self.errors = Counter(dict(zip(health.REMEDIES, counts, strict=True)))

    @override
    def diagnostics(self) -> dict[str, str]:
        found, wire, counter = super().diagnostics(), self._wire.counts(), self._sampler.counter
        found["board"] = f"{self._wire.name}, filter {self._cutoff_cHz / 100:g} Hz, every {self._period_us} us"
        found["readings"] = f"{self._sampler.samples}, {counter.missed} missed in {counter.gaps} gaps"
        found["wire"] = f"{wire.good} frames, {wire.bus_offs} bus-offs, {self._exchange.timeouts} time-outs"
        found["restarts"] = f"{self._boots + counter.restarts}"
        return found

    def _wish(self, cue: Jr3Event) -> None:
        if not self._advance(cue):
            problem = f"cannot be {cue.value} while {self.phase.value}"
            raise StateError(self._wire.name, problem, "poll it until it is in another phase")

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
            # Not repeated as it is: the answers for forces and moments look alike, so that a late one could be taken
            # for the other. The state is asked first again; its short answer cannot overtake a late long one.
            attempts = 1
        self._exchange.begin(Request(op, self._cutoff_cHz, self._period_us), attempts, ACK_TIMEOUT_NS)

    def _answered(self, ack: Ack, now_ns: int) -> None:
        self._heard = True
        if self._exchange.answer(ack, now_ns) is None:
            if self._exchange.request is None:
                self._sampler.unasked_ns = now_ns
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
        self._sampler.scale_by(FullScales((fx, fy, fz), (mx, my, mz)))
        self._advance(Jr3Event.DONE)

    def _booted(self) -> None:
        self._heard = True
        self._boots += 1
        self._boots_in_row += 1
        self._wire.forget()
        self._sampler.after_boot |= self._started
        if self._boots_in_row > MAX_BOOTS:
            self._fail(health.too_many_boots(self._wire.name, self._boots_in_row))
        elif self._advance(Jr3Event.BOOTED):
            self._fences = ATTEMPTS

    def _read(self, reading: Reading, now_ns: int) -> Jr3Sample | None:
        if self.phase not in READABLE:
            return None
        sample = self._sampler.take(reading, now_ns)
        if sample is not None:
            self.latest = sample
            self._boots_in_row = 0
            if self.phase in (Jr3Phase.AWAITING, Jr3Phase.SILENT):
                self._advance(Jr3Event.READ)
        return sample

    def _do_due(self, now_ns: int) -> None:
        patience_ns = self._settings.stall_ns
        if self.phase is Jr3Phase.AWAITING:
            patience_ns = max(patience_ns, FIRST_READING_NS)
        if self.phase in FLOWING and now_ns - self._sampler.last_new_ns > patience_ns:
            self._sampler.counter.resume()
            self._wire.forget()
            self._advance(Jr3Event.STALLED)
        if self._exchange.exhausted(now_ns):
            self._give_up()
        request = self._exchange.request
        if request is not None and self._exchange.due(now_ns):
            self._wire.send(request)

    def _give_up(self) -> None:
        if self.phase is Jr3Phase.READING_SCALES and self._fences > 0:
            self._fences -= 1
            self._advance(Jr3Event.RETRIED)
        elif self.phase is Jr3Phase.LEAVING:
            self._advance(Jr3Event.GAVE_UP)
        else:
            name, doing, refused = self._wire.name, self.phase.value, self._exchange.refused
            self._fail(health.no_answer(name, doing, self._wire.counts(), refused=refused, heard=self._heard))

    def _fail(self, error: DriverError, cue: Jr3Event = Jr3Event.GAVE_UP) -> None:
        if self._advance(cue):
            self.failure = error


_INTERVAL_S: Final = 0.002


def start_up(device: Jr3, clock_ns: Callable[[], int], sleep: Callable[[float], None], timeout_s: float = 30.0) -> None:
    """Open a sensor and wait until it streams.

    Args:
        device: Closed, silent or faulted.
        timeout_s: Longest wait, in s.

    Raises:
        DriverError: It does not stream; which one says why.
    """
    device.open()
    _wait(device, clock_ns, sleep, {Jr3Phase.STREAMING}, timeout_s)


def shut_down(
    device: Jr3, clock_ns: Callable[[], int], sleep: Callable[[float], None], timeout_s: float = 10.0
) -> None:
    """Stop the stream and wait until the board has taken that, or has not answered; does nothing when closed."""
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
