"""Measure a device through its port (rate, age, validity, noise) and the computer's wake-up delays."""

from collections import Counter
from collections.abc import Callable
from typing import Final, Generic, NamedTuple, TypeVar

import numpy as np

from palpate.adapters.config import SensorFactsTable
from palpate.adapters.hardware.doctor.findings import DeviceReport, Level, Topic
from palpate.adapters.hardware.sensor_facts import gathered, missing_facts
from palpate.core.errors import ConfigurationError
from palpate.core.ports import (
    CONTROL_RATE_HZ,
    SENSOR_FRAME,
    Clock,
    JointSample,
    SensorFacts,
    Snapshot,
    Validity,
    WrenchSample,
)
from palpate.core.supervision import NoiseMonitor, SampleMonitor, SupervisionConfig
from palpate.core.trial import PhaseConstraints, TaskConfig, Trip

_READ_NS: Final = 1_000_000
_RATE_SHARE: Final = 0.9
_BUSY: Final = "end other programs, or ask for real-time scheduling ([real_time] in --config)"
_STILL_N: Final = 1.0
"""Standard deviation above which the tool counts as moving or disturbed."""
_NAPS: Final = 100
_NAP_NS: Final = 3_000_000
_LATE_NS: Final = 3_000_000
"""Wake-up delay limit. If more than 1 % of ticks exceed it, the computer is too slow for 7 ms ticks."""
_RARE_SHARE: Final = 0.01
"""Maximum share of stale samples for which the computer is the more likely cause."""
_LIMITS: Final = SupervisionConfig(max_gap_ms=1000.0, weakened=("max_gap_ms",))
"""Limits used in a run, except the limit on the time between ticks, which :func:`report_clock` checks."""
SampleT = TypeVar("SampleT", WrenchSample, JointSample)


class Series(NamedTuple, Generic[SampleT]):
    """A device's readings in order, each with its time in ns and the latest sample."""

    reads: list[tuple[int, SampleT]]

    @property
    def samples(self) -> list[SampleT]:
        """Return the distinct samples in order of arrival."""
        found: dict[int, SampleT] = {}
        for _, sample in self.reads:
            found.setdefault(sample.sequence, sample)
        return list(found.values())

    @property
    def rate_Hz(self) -> float:
        """Return the mean rate in Hz, or 0 for fewer than two samples."""
        times_ns = [sample.receive_time_ns for sample in self.samples]
        span_ns = times_ns[-1] - times_ns[0] if times_ns else 0
        return (len(times_ns) - 1) * 1e9 / span_ns if span_ns > 0 else 0.0


class MeasuredNoise(NamedTuple):
    """Noise in the worst force and torque channels of an unloaded, stationary sensor, and its sample rate."""

    force_N: float
    torque_Nm: float
    rate_Hz: float


def listen(read: Callable[[], SampleT], clock: Clock, seconds: float) -> Series[SampleT]:
    """Read samples for the given number of seconds, at a higher rate than any loop runs at."""
    reads: list[tuple[int, SampleT]] = []
    end_ns = clock.now_ns() + round(seconds * 1e9)
    while (now_ns := clock.now_ns()) < end_ns:
        sample = read()
        reads.append((clock.now_ns(), sample))
        clock.sleep_until(now_ns + _READ_NS)
    return Series(reads)


def report_pace(
    series: Series[SampleT], expected_Hz: float | None, report: DeviceReport, least_Hz: float = 0.0
) -> None:
    """Check the sample rate.

    Args:
        expected_Hz: The configured rate; None if unknown.
        least_Hz: The rate that a run must exceed.
    """
    ages_ms = np.array([max(0, now_ns - sample.source_time_ns) for now_ns, sample in series.reads]) * 1e-6
    report.facts["age"] = f"{np.median(ages_ms):.1f} ms median, {ages_ms.max():.1f} ms at most"
    # A read returns the latest sample since the previous read; no loop needs more than one per tick.
    if expected_Hz is None:
        wanted_Hz, of, ill = CONTROL_RATE_HZ / 2, "", Level.NOTE
        remedy = f"the control loop runs at {CONTROL_RATE_HZ} Hz; set the device to send more often"
    else:
        wanted_Hz, ill = min(expected_Hz, float(CONTROL_RATE_HZ)), Level.WRONG
        of = f", the device is set to {expected_Hz:.1f} Hz"
        remedy = "check cable, power and the load of bus and computer, or set a larger divider"
        if expected_Hz < 2.0 * least_Hz:
            wanted_Hz, ill = 2.0 * least_Hz, Level.WRONG if expected_Hz <= least_Hz else Level.NOTE
            remedy = f"set it to {wanted_Hz:g} Hz, to verify contacts; a Net F/T on its page Communications"
    rate_Hz = series.rate_Hz
    report.judge(Topic.RATE, rate_Hz >= _RATE_SHARE * wanted_Hz, f"{rate_Hz:.1f} samples per second{of}", remedy, ill)


def report_samples(
    series: Series[SampleT], report: DeviceReport, noise: MeasuredNoise | None = None, frame: str = SENSOR_FRAME
) -> None:
    """Check the samples as the supervisor does in a run; ``frame`` is the force sensor's frame."""
    marks = Counter(sample.validity for _, sample in series.reads)
    counts = ", ".join(f"{marks[mark]} {mark.value}" for mark in Validity if mark is not Validity.VALID)
    # A sensor that shows no noise at all is also judged.
    facts = SensorFacts(*(noise[:2] if noise else (1e-9, 1e-9)), frame=frame)
    trip = _first_trip(series, facts)
    text = f"{len(series.reads)} reads, {counts}{f'; a run would end, because {trip.text}' if trip else ''}"
    fresh = Series([read for read in series.reads if read[1].validity is not Validity.STALE])
    if trip and len(fresh.reads) >= (1.0 - _RARE_SHARE) * len(series.reads) and _first_trip(fresh, facts) is None:
        remedy = f"{_BUSY}, and examine the rig for longer (--seconds 60)"
        report.add(Level.NOTE, Topic.SAMPLES, text, remedy)
        return
    remedy = "check load, cable, power and the adapter's settings, then switch the device off and on"
    if any(finding.topic is Topic.RATE and finding.level is Level.WRONG for finding in report.findings):
        remedy = "correct the rate first"
    report.judge(Topic.SAMPLES, trip is None, text, remedy)


def _first_trip(series: Series[SampleT], facts: SensorFacts) -> Trip | None:
    """Return the first trip that these samples, with valid samples from the other device, would cause in a run."""
    samples, noise = SampleMonitor(_LIMITS, facts), NoiseMonitor(_LIMITS, TaskConfig(), facts)
    samples.begin()
    noise.begin()
    due_ns = 0
    for number, (now_ns, sample) in enumerate(series.reads):
        if now_ns < due_ns:
            continue
        due_ns = now_ns + 1_000_000_000 // CONTROL_RATE_HZ
        if isinstance(sample, WrenchSample):
            snapshot = Snapshot(number, now_ns, sample, JointSample((), now_ns, now_ns, number))
            trip = samples.trip(snapshot) or noise.trip(snapshot, PhaseConstraints(contact=False))
        else:
            wrench = WrenchSample((float(number), 0.0, 0.0), (0.0, 0.0, 0.0), now_ns, now_ns, number)
            trip = samples.trip(Snapshot(number, now_ns, wrench, sample))
        if trip is not None:
            return trip
    return None


def report_wrench(series: Series[WrenchSample], report: DeviceReport) -> MeasuredNoise | None:
    """Check the noise of a stationary force sensor, and return it if it can be measured."""
    samples = [sample for sample in series.samples if sample.validity is not Validity.INVALID]
    if len(samples) < 2:
        report.add(Level.WRONG, Topic.NOISE, f"{len(samples)} usable samples", "check cable and power, then try again")
        return None
    channels = np.array([(*sample.force_N, *sample.torque_Nm) for sample in samples])
    means, sigmas = channels.mean(axis=0), channels.std(axis=0)
    for name, part, unit in (("force", slice(3), "N"), ("torque", slice(3, 6), "N m")):
        mean, sigma = (", ".join(f"{value:+.3f}" for value in means[part]), ", ".join(f"{s:.4f}" for s in sigmas[part]))
        report.facts[name] = f"{mean} {unit}; sigma {sigma}"
    if (channels == channels[0]).all():
        return None
    noise = MeasuredNoise(float(sigmas[:3].max()), float(sigmas[3:].max()), series.rate_Hz)
    text = f"noise {noise.force_N:.2g} N and {noise.torque_Nm:.2g} N m (one sigma)"
    remedy = "do not touch the tool or the arm; if that does not help, check shield, ground and filter"
    report.judge(Topic.NOISE, noise.force_N <= _STILL_N, text, remedy, Level.NOTE)
    return noise


def report_facts(
    stated: SensorFactsTable, reported: SensorFactsTable, measured: MeasuredNoise, report: DeviceReport
) -> None:
    """Check that the known properties of the sensor suffice for a run and agree with the measurement."""
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
        # Noise depends on machines nearby.
        good = known <= value * _LIMITS.max_noise_ratio and value <= known * _LIMITS.max_noise_ratio
        text = f"measured noise {value:.2g} {unit}, specified {known:g} {unit}"
        report.judge(Topic.FACTS, good, text, f"do not touch the tool; if that does not help, {remedy}")


def report_clock(clock: Clock, report: DeviceReport) -> None:
    """Check the wake-up delays of this computer."""
    late_ns, due_ns = [], clock.now_ns()
    for _ in range(_NAPS):
        due_ns += _NAP_NS
        clock.sleep_until(due_ns)
        now_ns = clock.now_ns()
        late_ns.append(now_ns - due_ns)
        due_ns = now_ns
    late_ns.sort()
    if late_ns[0] < 0:
        text = f"the clock wakes up {-late_ns[0] * 1e-6:.3f} ms early"
        report.add(Level.WRONG, Topic.CLOCK, text, "choose another clock source of the system")
        return
    text = f"wake-ups are {np.median(late_ns) * 1e-6:.2f} ms late (median), {late_ns[-1] * 1e-6:.2f} ms at most"
    report.judge(Topic.CLOCK, late_ns[-2] <= _LATE_NS, text, _BUSY, Level.NOTE)
