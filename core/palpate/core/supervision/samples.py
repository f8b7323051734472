"""Are the samples news, and does the loop keep its time?"""

from __future__ import annotations

from palpate.core.supervision.values import Trip, TripReason
from palpate.core.supervision_config import SupervisionConfig
from palpate.core.values import Snapshot, Validity, Vector3

_NS_PER_MS = 1e6


class SampleWatch:
    """Validity, age and progress of both sensors' samples, and the time between ticks.

    Args:
        config: The limits.
        noisy: Whether the force sensor shows noise, so that equal samples mean that it is frozen.
    """

    def __init__(self, config: SupervisionConfig, *, noisy: bool = True) -> None:
        self._force_age_ns = round(config.max_force_age_ms * _NS_PER_MS)
        self._joint_age_ns = round(config.max_joint_age_ms * _NS_PER_MS)
        self._gap_ns = round(config.max_gap_ms * _NS_PER_MS)
        self._most_repeats, self._most_equal = config.max_repeats, config.max_equal_samples
        self._noisy = noisy
        self.begin()

    def begin(self) -> None:
        """A trial begins."""
        self._last_ns: int | None = None
        self._sequences: tuple[int | None, int | None] = (None, None)
        self._wrench_repeats = self._joint_repeats = self._equal = 0
        self._values: tuple[Vector3, Vector3] | None = None

    def trip(self, snapshot: Snapshot) -> Trip | None:
        """What is wrong with this tick's samples; None if nothing is."""
        wrench, joints, now_ns = snapshot.wrench, snapshot.joints, snapshot.time_ns
        if wrench.validity is not Validity.VALID:
            return self._not_valid(snapshot.tick, "force", wrench.validity)
        if joints.validity is not Validity.VALID:
            return self._not_valid(snapshot.tick, "joint", joints.validity)
        last_ns, self._last_ns = self._last_ns, now_ns
        if last_ns is not None and not 0 <= now_ns - last_ns <= self._gap_ns:
            return _times(
                TripReason.LATE_CYCLE, snapshot.tick, "time since the last tick", now_ns - last_ns, self._gap_ns
            )
        age_ns, most_ns = now_ns - wrench.source_time_ns, self._force_age_ns
        # A sample from the future is as bad: the clocks disagree, and its age means nothing.
        if not -most_ns <= age_ns <= most_ns:
            return _times(TripReason.SAMPLE_STALE, snapshot.tick, "age of the force sample", age_ns, most_ns)
        age_ns, most_ns = now_ns - joints.source_time_ns, self._joint_age_ns
        if not -most_ns <= age_ns <= most_ns:
            return _times(TripReason.SAMPLE_STALE, snapshot.tick, "age of the joint sample", age_ns, most_ns)
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
        return Trip(TripReason.SAMPLE_REPEATED, tick, float(repeats), float(most), text)

    def _frozen(self, tick: int) -> Trip:
        found, most = self._equal, self._most_equal
        text = f"{found} new force samples in a row are equal to the one before in every bit, limit {most}"
        return Trip(TripReason.SAMPLE_FROZEN, tick, float(found), float(most), text)

    @staticmethod
    def _not_valid(tick: int, name: str, validity: Validity) -> Trip:
        return Trip(TripReason.SAMPLE_INVALID, tick, 1.0, 0.0, f"the {name} sample is {validity.value}")


def _times(reason: TripReason, tick: int, what: str, found_ns: int, limit_ns: int) -> Trip:
    found, limit = found_ns / _NS_PER_MS, limit_ns / _NS_PER_MS
    return Trip(reason, tick, found, limit, f"{what} {found:.1f} ms, limit {limit:g} ms")
