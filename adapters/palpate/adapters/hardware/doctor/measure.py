"""Measures a device by its port alone: rate, age, marks, noise; and how late this computer wakes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import fmean, median, pstdev
from typing import Final, Generic, TypeVar

from palpate.adapters.hardware.doctor.findings import DeviceReport, Level, Topic
from palpate.core.ports import CONTROL_RATE_HZ, Clock, JointSample, Validity, WrenchSample

_READ_NS: Final = 1_000_000
_RATE_SHARE: Final = 0.9
_FEW: Final = 0.01
_STILL_N: Final = 1.0
"""Standard deviation above which something moves or disturbs the tool."""
_NAPS: Final = 100
_NAP_NS: Final = 3_000_000
_LATE_NS: Final = 3_000_000
"""A computer that wakes this late more than once in a hundred times is too slow for ticks of 7 ms."""
SampleT = TypeVar("SampleT", WrenchSample, JointSample)


@dataclass(frozen=True, slots=True)
class Series(Generic[SampleT]):
    """Different samples of a device in the order in which they came.

    Attributes:
        ages_ns: Age of the newest sample at each read.
        reads: How often each mark was read.
    """

    samples: tuple[SampleT, ...]
    ages_ns: tuple[int, ...]
    reads: dict[Validity, int]

    @property
    def rate_Hz(self) -> float:
        """Mean rate; 0 of fewer than two samples."""
        times_ns = [sample.receive_time_ns for sample in self.samples]
        span_ns = times_ns[-1] - times_ns[0] if times_ns else 0
        return (len(times_ns) - 1) * 1e9 / span_ns if span_ns > 0 else 0.0


@dataclass(frozen=True, slots=True)
class MeasuredNoise:
    """Noise of a sensor at rest, the worst channel of each kind, and its rate."""

    force_N: float
    torque_Nm: float
    rate_Hz: float


def listen(read: Callable[[], SampleT], clock: Clock, seconds: float) -> Series[SampleT]:
    """Read for a while, more often than any loop does."""
    samples: dict[int, SampleT] = {}
    ages_ns: list[int] = []
    reads = dict.fromkeys(Validity, 0)
    end_ns = clock.now_ns() + round(seconds * 1e9)
    while (now_ns := clock.now_ns()) < end_ns:
        sample = read()
        ages_ns.append(max(0, clock.now_ns() - sample.source_time_ns))
        reads[sample.validity] += 1
        samples.setdefault(sample.sequence, sample)
        clock.sleep_until(now_ns + _READ_NS)
    return Series(tuple(samples.values()), tuple(ages_ns), reads)


def report_pace(series: Series[SampleT], expected_Hz: float | None, report: DeviceReport) -> None:
    """Judge rate and marks of samples.

    Args:
        expected_Hz: Rate that the device is set to; None where that is not known.
    """
    ages_ms = [age * 1e-6 for age in series.ages_ns]
    report.facts["age"] = f"{median(ages_ms):.1f} ms median, {max(ages_ms):.1f} ms at most"
    # A read takes the newest of the samples that came since the last one; no loop needs more than one a tick.
    wanted_Hz = CONTROL_RATE_HZ / 2 if expected_Hz is None else min(expected_Hz, float(CONTROL_RATE_HZ))
    rate_Hz = series.rate_Hz
    of = "" if expected_Hz is None else f", the device is set to {expected_Hz:.1f} Hz"
    remedy = (
        "check cable, power and the load of bus and computer, or set a larger divider"
        if expected_Hz is not None
        else f"the control loop runs at {CONTROL_RATE_HZ} Hz; set the device to send more often"
    )
    ill = Level.NOTE if expected_Hz is None else Level.WRONG
    good = rate_Hz >= _RATE_SHARE * wanted_Hz
    report.judge(Topic.RATE, good, f"{rate_Hz:.1f} new samples a second{of}", remedy, ill)
    old, bad = series.reads[Validity.STALE], series.reads[Validity.INVALID]
    reads = sum(series.reads.values())
    ill = Level.WRONG if old + bad > _FEW * reads else Level.NOTE
    remedy = "check cable and power, and the adapter's settings"
    report.judge(Topic.SAMPLES, not old and not bad, f"{old} of {reads} reads were stale, {bad} invalid", remedy, ill)


def report_wrench(series: Series[WrenchSample], report: DeviceReport) -> MeasuredNoise | None:
    """Judge noise and range of a force sensor at rest; return the noise where it can be measured."""
    samples = [sample for sample in series.samples if sample.validity is not Validity.INVALID]
    if len(samples) < 2:
        report.add(Level.WRONG, Topic.NOISE, f"{len(samples)} usable samples", "check cable and power, then try again")
        return None
    channels = tuple(zip(*((*s.force_N, *s.torque_Nm) for s in samples), strict=True))
    means, sigmas = [fmean(c) for c in channels], [pstdev(c) for c in channels]
    report.facts["force"] = _listed(means[:3], sigmas[:3], "N")
    report.facts["torque"] = _listed(means[3:], sigmas[3:], "N m")
    full = sum(sample.validity is Validity.SATURATED for sample in samples)
    remedy = "take the load off the tool; if it stays, the sensor is overloaded or its cable damaged"
    report.judge(Topic.RANGE, not full, f"{full} of {len(samples)} samples are saturated", remedy)
    if not max(sigmas):
        remedy = "switch the sensor off and on, and check its cable"
        report.add(Level.WRONG, Topic.NOISE, "all samples are equal to the last bit", remedy)
        return None
    text = f"noise {max(sigmas[:3]):.2g} N and {max(sigmas[3:]):.2g} N m (one sigma)"
    remedy = "leave the tool alone and let the arm rest; if it stays, check shield, ground and filter"
    report.judge(Topic.NOISE, max(sigmas[:3]) <= _STILL_N, text, remedy, Level.NOTE)
    return MeasuredNoise(max(sigmas[:3]), max(sigmas[3:]), series.rate_Hz)


def report_clock(clock: Clock, report: DeviceReport) -> None:
    """Judge how late this computer wakes."""
    late_ns, due_ns = [], clock.now_ns()
    for _ in range(_NAPS):
        due_ns += _NAP_NS
        clock.sleep_until(due_ns)
        now_ns = clock.now_ns()
        late_ns.append(now_ns - due_ns)
        due_ns = now_ns
    late_ns.sort()
    text = f"this computer wakes {median(late_ns) * 1e-6:.2f} ms late (median), {late_ns[-1] * 1e-6:.2f} ms at most"
    if late_ns[0] < 0:
        text = f"the clock wakes {-late_ns[0] * 1e-6:.3f} ms before the time that it is to wait for"
        report.add(Level.WRONG, Topic.CLOCK, text, "choose another clock source of the system")
        return
    remedy = "end other programs, or ask for real-time scheduling ([real_time] in --config)"
    report.judge(Topic.CLOCK, late_ns[-2] <= _LATE_NS, text, remedy, Level.NOTE)


def _listed(means: Sequence[float], sigmas: Sequence[float], unit: str) -> str:
    return ", ".join(f"{mean:+.3f}" for mean in means) + f" {unit}; sigma {', '.join(f'{s:.4f}' for s in sigmas)}"
