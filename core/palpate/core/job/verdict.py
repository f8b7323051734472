"""Verdict on a job: its feasibility, the reasons, and the best built-in task and policy."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import degrees, inf, isclose, pi, sqrt, tan
from typing import Final

from palpate.core.errors import ConfigurationError
from palpate.core.job.derived import JAMS_FROM, MOST_PRESS_SHARE, Constants, Derived, Quantities, derive
from palpate.core.job.regime import DEVIATIONS, Regime, depth_parts_m, largest_tilt_rad
from palpate.core.job.remedy import Verification
from palpate.core.job.settings import attempts, corner_distance_mm
from palpate.core.job.tables import KEYED, ROUND, SIDES, Job
from palpate.core.ports import SensorFacts

PLAIN: Final = "insertion"
SPATIAL: Final = "insertion-6dof"
BELIEF_AREA_MM: Final = 8.0
"""Half the side length of the largest area whose belief can be updated within a tick."""
_SLIDES_SHARE: Final = 0.52
"""Maximum fraction of the sticking friction at which a corner still slides in time."""
_TIGHT_MM: Final = 0.05
"""Radial clearance above which a corner stuck next to its corner of the hole still enters along broken edges."""
_MOST_WEDGED: Final = 1.6
"""Maximum wedge number at which the search and the gripper can still free a peg."""
_MANY_ATTEMPTS: Final = 5.0
"""Number of attempts that take more than half the time limit of the smallest search."""
_LEAST_CORNER_MM: Final = 4.0
"""Corner distance from the axis below which tilting lowers a corner by less than the depth accuracy."""


@dataclass(frozen=True)
class Choice:
    """The best task and policy for a job.

    Attributes:
        learner: Learner to train; ``q-learning``, the default setting, for a rule that needs no training.
        policy: Rule name; empty for a learner.
        reason: Reason for the choice.
    """

    task: str
    learner: str
    policy: str
    reason: str

    @property
    def command(self) -> str:
        """Return the ``palpate train`` command for a learner, or the ``palpate run`` command for a rule."""
        task = "" if self.task == PLAIN else f" --task {self.task}"
        named = f"run --policy {self.policy}" if self.policy else f"train --learner {self.learner}"
        return f"palpate {named}{task}"


@dataclass(frozen=True)
class Verdict:
    """Assessment of a job before any motion.

    Attributes:
        reasons: Reasons why the job is not feasible, each with a remedy; empty for a feasible job.
        caution: Reason why a feasible job may fail more often, with a remedy; may be empty.
    """

    derived: Derived
    regime: Regime
    choice: Choice
    reasons: tuple[str, ...]
    caution: str = ""


def judge(job: Job, sensor: SensorFacts, *, step_mm: float, task: str = "") -> Verdict:
    """Judge whether a job is feasible, and choose a task and a policy.

    Args:
        step_mm: Standard deviation of the tip position along the tool due to encoder steps.
        task: Task name; empty selects the best built-in one.
    """
    quantities = Quantities.of(job, sensor)
    found = derive(quantities)
    verification = Verification(quantities, step_mm * 1e-3)
    regime = verification.regime
    jams = regime.held_N > found.insertion_press_N
    named = task or (PLAIN if job.part.shape == ROUND else SPATIAL)
    choice = _choice(job, found, named)
    reasons = [_depth_reason(job, quantities, regime), verification.refusal()]
    if jams and job.part.shape == ROUND:
        reasons.append(_jam_reason(job, quantities, found, regime))
    elif choice.task == PLAIN and regime.wedge_number > _MOST_WEDGED and regime.jam_number > JAMS_FROM:
        reasons.append(f"{_wedge(job, regime)}: reduce the tilt to {_free_mrad(job, regime):.2g} mrad")
    reasons += (_torque_reason(quantities, found, choice), _shape_reason(job, named, choice))
    return Verdict(found, regime, choice, tuple(filter(None, reasons)), _caution(job, choice, regime))


def require_measurable(job: Job, sensor: SensorFacts, *, step_mm: float, tolerance_mm: float, press_N: float) -> None:
    """Reject a job whose contacts cannot be verified, or whose tolerance is below four standard deviations of depth.

    Args:
        tolerance_mm: Depth tolerance for the task to run.
        press_N: Pressing force for that task.

    Raises:
        ConfigurationError: The contacts cannot be verified, or the tolerance is too small.
    """
    quantities = replace(Quantities.of(job, sensor), tolerance_m=tolerance_mm * 1e-3)
    if short := _short_depth(quantities, depth_parts_m(quantities, step_mm * 1e-3, Constants())):
        least_mm, remedy = short
        accepted = f"at least {least_mm:.2g}, four standard deviations of depth; or {remedy}"
        table = job.part.TABLE if tolerance_mm == job.part.depth_tolerance_mm else "task"
        raise ConfigurationError(f"{table}.depth_tolerance_mm", tolerance_mm, accepted)
    derived_N = derive(quantities).press_N
    by_hand_N = 0.0 if isclose(press_N, derived_N, rel_tol=1e-3) else press_N
    verification = Verification(quantities, step_mm * 1e-3, by_hand_N)
    if refusal := verification.refusal():
        axis = verification.axis
        raise ConfigurationError(f"{job.tool.TABLE}.{axis}", getattr(job.tool, axis), refusal)


def _short_depth(job: Quantities, parts: tuple[float, float, float]) -> tuple[float, str] | None:
    """Return 4 standard deviations of depth (noise, tilt, encoders), in mm, and a remedy if they are too large."""
    noise_m, tilted_m, _ = parts
    square, most_m = sum(part * part for part in parts), max(parts)
    least_m, left = DEVIATIONS * sqrt(square), (job.tolerance_m / DEVIATIONS) ** 2 - square + most_m * most_m
    if least_m <= job.tolerance_m:
        return None
    # The largest contribution is the cheapest to reduce, unless the others alone are too large.
    share = sqrt(max(left, 0.0)) / most_m
    remedy = "use an arm with finer encoders"
    if most_m == noise_m:
        remedy = f"use a force sensor with at most {share * job.noise_N:.2g} N of noise"
    elif most_m == tilted_m:
        remedy = f"reduce the tilt to {share * job.tilt_rad * 1e3:.2g} mrad"
    return least_m * 1e3, remedy if share else "use a quieter force sensor, a smaller tilt and finer encoders"


def _choice(job: Job, found: Derived, task: str) -> Choice:
    if task == PLAIN:
        if found.half_width_m * 1e3 > BELIEF_AREA_MM:
            reason = f"the area of {found.half_width_m * 1e3:.3g} mm is too large for a belief"
            return Choice(task, "q-learning", "torque", reason)
        return Choice(task, "belief", "", "a peg that needs no turn")
    if job.part.shape != ROUND:
        return Choice(task, "q-learning", "corner-first", f"a {job.part.shape} peg, whose turn only a corner shows")
    return Choice(task, "q-learning", "torque", "a round peg, whose torque points at the hole")


def _depth_reason(job: Job, quantities: Quantities, regime: Regime) -> str:
    if not (short := _short_depth(quantities, (regime.noise_m, regime.tilted_m, regime.step_m))):
        return ""
    return (
        f"the depth tolerance, {job.part.depth_tolerance_mm:g} mm, is below four standard deviations of depth,"
        f" {short[0]:.2g} mm: allow that, or {short[1]}"
    )


def _jam_reason(job: Job, quantities: Quantities, found: Derived, regime: Regime) -> str:
    tilt_mrad = largest_tilt_rad(quantities, found.press_N) * 1e3
    at = job.part.depth_mm if regime.jam_depth_m == inf else regime.jam_depth_m * 1e3
    return (
        f"a peg tilted by {job.place.tilt_uncertainty_mrad:g} mrad jams at {at:.2g} mm (J = {regime.jam_number:.1f}):"
        f" press with at least {regime.held_N:.2g} N (limits.force_N of at least"
        f" {regime.held_N / MOST_PRESS_SHARE:.3g}), or reduce the tilt to {tilt_mrad:.2g} mrad"
    )


def _torque_reason(job: Quantities, found: Derived, choice: Choice) -> str:
    most_Nm = found.press_N * job.radius_m
    hidden = job.tilt_Nm_per_rad * job.tilt_rad > 2.0 * most_Nm or found.torque_Nm > most_Nm
    if choice.policy != "torque" or not hidden:
        return ""
    return (
        f"the area of {found.half_width_m * 1e3:.3g} mm is above {BELIEF_AREA_MM:g} mm, the most that the learner"
        f" belief covers, and the torque of the tilt or of noise hides that of the hole from the torque rule: locate"
        f" the hole within {BELIEF_AREA_MM - 0.5:g} mm"
    )


def _shape_reason(job: Job, task: str, choice: Choice) -> str:
    part, corner_mm = job.part, corner_distance_mm(job.part)
    if task == PLAIN and part.shape != ROUND:
        # A side of half-length s can turn by c / s between walls.
        half_mm = sqrt(max(corner_mm * corner_mm - part.peg_mm * part.peg_mm / 4.0, 0.0)) or part.peg_mm / 2.0
        free_deg = degrees(part.clearance_mm / half_mm)
        if job.place.yaw_uncertainty_deg > free_deg:
            return (
                f"a {part.shape} peg turned by {job.place.yaw_uncertainty_deg:g} degrees does not fit: use --task"
                f" {SPATIAL}, or reduce the yaw to {free_deg:.2g} degrees"
            )
    if choice.policy == "corner-first" and corner_mm < _LEAST_CORNER_MM:
        name = "flat" if part.shape == KEYED else "nearest corner"
        return (
            f"the {name} is {corner_mm:.2g} mm from the axis, too near to be felt first: use a part whose {name} is at"
            f" least {_LEAST_CORNER_MM:g} mm from it, or align the part within its clearance"
        )
    return ""


def _wedge(job: Job, regime: Regime) -> str:
    """Describe wedging using Whitney's condition that the line between the two contacts lies in both friction cones."""
    tilt_mrad = job.place.tilt_uncertainty_mrad
    return f"a peg tilted by {tilt_mrad:g} mrad may wedge in the mouth of the hole (W = {regime.wedge_number:.1f})"


def _free_mrad(job: Job, regime: Regime) -> float:
    return job.place.tilt_uncertainty_mrad * _MOST_WEDGED / regime.wedge_number


def _caution(job: Job, choice: Choice, regime: Regime) -> str:
    """Return the reason why trials may fail more often, with a remedy."""
    part, sides = job.part, SIDES.get(job.part.shape, 0)
    if choice.task == PLAIN and regime.wedge_number > _MOST_WEDGED:
        return f"{_wedge(job, regime)}: a tilt below {_free_mrad(job, regime):.2g} mrad helps"
    if choice.policy != "corner-first" or part.shape == ROUND:
        return ""
    if (tries := attempts(part)) > _MANY_ATTEMPTS:
        play_mrad = 2e3 * part.clearance_mm / part.peg_mm
        enough_mm = part.clearance_mm * tries / _MANY_ATTEMPTS
        return (
            f"a play of {play_mrad:.2g} mrad is little for what a push shows of the turn: about {tries:.0f} attempts,"
            f" and a time limit to match; a radial clearance of {enough_mm:.2g} mm helps"
        )
    # A corner pushed along its bisector slides into place only outside the friction cones of its walls.
    most = _SLIDES_SHARE * tan(pi / sides) if sides else inf
    if part.friction_max <= most or part.clearance_mm >= _TIGHT_MM:
        return ""
    return (
        f"corners of a {part.shape} slide slowly into a hole with a radial clearance below {_TIGHT_MM:g} mm and a"
        f" friction above {most:.1f}: expect time limits"
    )
