"""Measurements of a device by its port (rate, age, marks, noise), and of the wake-up delays of this computer."""

from collections.abc import Callable
from typing import Final, Generic, NamedTuple, TypeVar

import numpy as np

from palpate.adapters.config import SensorFactsTable
from palpate.adapters.hardware.doctor.findings import DeviceReport, Level, Topic
from palpate.adapters.hardware.sensor_facts import gathered, missing_facts
from palpate.core.errors import ConfigurationError
from palpate.core.ports import CONTROL_RATE_HZ, Clock, JointSample, Validity, WrenchSample

_READ_NS: Final = 1_000_000
_RATE_SHARE: Final = 0.9
_FEW: Final = 0.01
_STILL_N: Final = 1.0
"""Standard deviation above which the tool moves or is disturbed."""
_NAPS: Final = 100
_NAP_NS: Final = 3_000_000
_LATE_NS: Final = 3_000_000
"""A computer that wakes later than this in more than 1 % of ticks is too slow for ticks of 7 ms."""
_FACTOR: Final = 2.0
"""Accepted factor between measured and stated noise, because noise depends on machines nearby."""
SampleT = TypeVar("SampleT", WrenchSample, JointSample)


class Series(NamedTuple, Generic[SampleT]):
    """Different samples of a device in order of arrival, with the age and the mark of the latest one at each read."""

    samples: list[SampleT]
    ages_ns: list[int]
    marks: list[Validity]

    @property
    def rate_Hz(self) -> float:
        """Return the mean rate; 0 for fewer than two samples."""
        times_ns = [sample.receive_time_ns for sample in self.samples]
        span_ns = times_ns[-1] - times_ns[0] if times_ns else 0
        return (len(times_ns) - 1) * 1e9 / span_ns if span_ns > 0 else 0.0


class MeasuredNoise(NamedTuple):
    """Noise of an unloaded, stationary sensor in the worst channel of each kind, and its rate."""

    force_N: float
    torque_Nm: float
    rate_Hz: float


def listen(read: Callable[[], SampleT], clock: Clock, seconds: float) -> Series[SampleT]:
    """Read for a time, more often than any loop."""
    samples: dict[int, SampleT] = {}
    ages_ns: list[int] = []
    marks: list[Validity] = []
    end_ns = clock.now_ns() + round(seconds * 1e9)
    while (now_ns := clock.now_ns()) < end_ns:
        sample = read()
        ages_ns.append(max(0, clock.now_ns() - sample.source_time_ns))
        marks.append(sample.validity)
        samples.setdefault(sample.sequence, sample)
        clock.sleep_until(now_ns + _READ_NS)
    return Series(list(samples.values()), ages_ns, marks)


def report_pace(series: Series[SampleT], expected_Hz: float | None, report: DeviceReport) -> None:
    """Judge rate and marks of samples; ``expected_Hz`` is the configured rate, None if unknown."""
    ages_ms = np.array(series.ages_ns) * 1e-6
    report.facts["age"] = f"{np.median(ages_ms):.1f} ms median, {ages_ms.max():.1f} ms at most"
    # A read returns the latest sample since the previous read; no loop needs more than one per tick.
    if expected_Hz is None:
        wanted_Hz, of, ill = CONTROL_RATE_HZ / 2, "", Level.NOTE
        remedy = f"the control loop runs at {CONTROL_RATE_HZ} Hz; set the device to send more often"
    else:
        wanted_Hz, ill = min(expected_Hz, float(CONTROL_RATE_HZ)), Level.WRONG
        of = f", the device is set to {expected_Hz:.1f} Hz"
        remedy = "check cable, power and the load of bus and computer, or set a larger divider"
    rate_Hz = series.rate_Hz
    report.judge(Topic.RATE, rate_Hz >= _RATE_SHARE * wanted_Hz, f"{rate_Hz:.1f} new samples a second{of}", remedy, ill)
    old, bad, reads = series.marks.count(Validity.STALE), series.marks.count(Validity.INVALID), len(series.marks)
    ill = Level.WRONG if old + bad > _FEW * reads else Level.NOTE
    remedy = "check cable and power, and the adapter's settings"
    report.judge(Topic.SAMPLES, not old and not bad, f"{old} of {reads} reads were stale, {bad} invalid", remedy, ill)


def report_wrench(series: Series[WrenchSample], report: DeviceReport) -> MeasuredNoise | None:
    """Check noise and range of a stationary force sensor; return the noise if it can be measured."""
    samples = [sample for sample in series.samples if sample.validity is not Validity.INVALID]
    if len(samples) < 2:
        report.add(Level.WRONG, Topic.NOISE, f"{len(samples)} usable samples", "check cable and power, then try again")
        return None
    channels = np.array([(*sample.force_N, *sample.torque_Nm) for sample in samples])
    means, sigmas = channels.mean(axis=0), channels.std(axis=0)
    for name, part, unit in (("force", slice(3), "N"), ("torque", slice(3, 6), "N m")):
        mean, sigma = (", ".join(f"{value:+.3f}" for value in means[part]), ", ".join(f"{s:.4f}" for s in sigmas[part]))
        report.facts[name] = f"{mean} {unit}; sigma {sigma}"
    full = sum(sample.validity is Validity.SATURATED for sample in samples)
    remedy = "take the load off the tool; if it stays, the sensor is overloaded or its cable damaged"
    report.judge(Topic.RANGE, not full, f"{full} of {len(samples)} samples are saturated", remedy)
    if (channels == channels[0]).all():
        remedy = "switch the sensor off and on, and check its cable"
        report.add(Level.WRONG, Topic.NOISE, "all samples are equal to the last bit", remedy)
        return None
    noise = MeasuredNoise(float(sigmas[:3].max()), float(sigmas[3:].max()), series.rate_Hz)
    text = f"noise {noise.force_N:.2g} N and {noise.torque_Nm:.2g} N m (one sigma)"
    remedy = "leave the tool alone and keep the arm stationary; if it stays, check shield, ground and filter"
    report.judge(Topic.NOISE, noise.force_N <= _STILL_N, text, remedy, Level.NOTE)
    return noise


def report_facts(
    stated: SensorFactsTable, reported: SensorFactsTable, measured: MeasuredNoise, report: DeviceReport
) -> None:
    """Judge whether the known properties of the sensor suffice for a run and agree with the measurement."""
    missing = missing_facts(stated, reported)
    values = dict(zip(("noise_N", "noise_Nm", "rate_Hz"), (f"{value:.3g}" for value in measured), strict=True))
    lines = [f"{name} = {values.get(name, '[x, y, z]')}" for name in missing or ("noise_N", "noise_Nm")]
    remedy = f"below [force_sensor] write facts = {{ {', '.join(lines)} }}"
    if missing:
        text = f"neither rig file nor sensor states {', '.join(missing)}, which every run requires"
        by_hand = " (x, y, z: from the data sheet)" if "[x, y, z]" in remedy else ""
        report.add(Level.WRONG, Topic.FACTS, text, remedy + by_hand)
        return
    try:
        facts = gathered(stated, reported)
    except ConfigurationError as error:
        report.error(error)
        return
    found = ((measured.force_N, facts.noise_N, "N"), (measured.torque_Nm, facts.noise_Nm, "N m"))
    for value, known, unit in found:
        good = known / _FACTOR <= value <= known * _FACTOR
        text = f"measured noise {value:.2g} {unit}, stated {known:g} {unit}"
        report.judge(Topic.FACTS, good, text, f"leave the tool alone and try again; if it stays, {remedy}")


def report_clock(clock: Clock, report: DeviceReport) -> None:
    """Judge the wake-up delays of this computer."""
    late_ns, due_ns = [], clock.now_ns()
    for _ in range(_NAPS):
        due_ns += _NAP_NS
        clock.sleep_until(due_ns)
        now_ns = clock.now_ns()
        late_ns.append(now_ns - due_ns)
        due_ns = now_ns
    late_ns.sort()
    if late_ns[0] < 0:
        text = f"the clock wakes {-late_ns[0] * 1e-6:.3f} ms before the time that it is to wait for"
        report.add(Level.WRONG, Topic.CLOCK, text, "choose another clock source of the system")
        return
    text = f"this computer wakes {np.median(late_ns) * 1e-6:.2f} ms late (median), {late_ns[-1] * 1e-6:.2f} ms at most"
    remedy = "end other programs, or ask for real-time scheduling ([real_time] in --config)"
    report.judge(Topic.CLOCK, late_ns[-2] <= _LATE_NS, text, remedy, Level.NOTE)
