"""Settings as logs and run folders have them: by the names and with the defaults of the time when they were written."""

import copy
from collections.abc import Mapping, Sequence
from typing import Any, Final

from palpate.adapters.config.renames import RENAMED
from palpate.adapters.config.run import RunConfig
from palpate.adapters.config.toml import overlay
from palpate.core.policy.belief import BeliefParameters
from palpate.core.supervision import SupervisionConfig, weaker_settings

UNTOLD: Final[Mapping[str, Any]] = {
    "learner": "q-learning",
    "learning.trace_decay": 0.8,
    "learning.keep_steps": 1,
    "learning.share_turns": False,
    "cell.conditions.hole_shift_mm": 0.0,
    "cell.conditions.hole_shift_trials": 0,
    "cell.conditions.tilt_heading": "set",
    "cell.conditions.grip_trials": 0,
    "cell.conditions.zero_shift_N": 0.0,
    "cell.conditions.zero_shift_Nm": 0.0,
    "cell.conditions.zero_drift_N_s": 0.0,
    "cell.conditions.zero_drift_Nm_s": 0.0,
    "cell.conditions.zero_heading": "set",
    "cell.conditions.zero_heading_deg": 0.0,
    "cell.conditions.zero_trials": 0,
    "cell.conditions.wear_mm": 0.0,
    "cell.conditions.wear_trials": 100,
    "cell.conditions.yaw_deg": 0.0,
    "cell.conditions.plate_lean_mrad": 0.0,
    "cell.contacts": "searched",
    "cell.contour.shape": "none",
    "cell.contour.amplitude_mm": 2.0,
    "cell.contour.wavelength_mm": 80.0,
    "cell.contour.length_mm": 260.0,
    "cell.contour.ball_radius_mm": 5.0,
    "cell.peg.contact": "spheres",
    "cell.peg.corner_radius_mm": 3.0,
    "cell.peg.flat_mm": 3.0,
    "cell.peg.chamfer_mm": 0.0,
    "cell.peg.outer_boxes": 0,
    "cell.peg.upper_spheres": 0,
    "cell.substeps": 5,
    "cell.leaning_impedance": 0.95,
    "perception.memory": "none",
    "learning.back_off_visits": 0.0,
    "learning.initial_value": 0.0,
    "learning.rule_lead": 0.0,
    "learning.temperature_in_use": 1e6,
    "real_time.stay_awake": False,
    "supervision.max_force_N": 40.0,
    "supervision.max_torque_Nm": 6.0,
    "supervision.max_recurring_samples": 1_000_000,
    "supervision.flat_line_samples": 1_000_000,
    "supervision.max_noise_ratio": 1e6,
    "task.prove_contact": False,
    "task.uneven_heave": False,
    "task.name": "insertion",
    "task.options": {},
    "task.moving_share": 0.8,
    "task.play_mm": 0.6,
    "task.directions": 8,
    **{BeliefParameters.dotted(name): value for name, value in BeliefParameters.UNTOLD.items()},
}
"""What a record means that lacks one of these settings: what was done before there was such a setting.

Whoever adds a setting adds it here, and whoever changes a default adds what it was: records are read for ever, and
lacking a setting never means a new default.
"""

_OPTIONS_UNTOLD: Final[Mapping[str, Mapping[str, float]]] = {
    "insertion-6dof": {"down_share": 0.0, "wobble_deg_s": 0.0, "unanswered_N": 0.0},
}
"""The same of options of a task, by its name."""


def recorded(table: Mapping[str, Any]) -> dict[str, Any]:
    """The table of settings in a record, with the names of today and with what it leaves untold.

    Args:
        table: As TOML has it, without the table ``[run]``.
    """
    told = copy.deepcopy(dict(table))
    for old, names in RENAMED.items():
        path, _, last = old.rpartition(".")
        held = _held(told, path)
        if last in held:
            value = held.pop(last)
            for name in names:
                _put(told, name, value)
    for name, value in UNTOLD.items():
        _put(told, name, copy.copy(value))
    for name, value in _OPTIONS_UNTOLD.get(str(_held(told, "task").get("name")), {}).items():
        _put(told, f"task.options.{name}", value)
    _admit_limits(told.get(SupervisionConfig.TABLE))
    return told


def _admit_limits(supervision: Any) -> None:
    """A limit that was no weakening when it was recorded is none to be refused for now: it is named as one."""
    if not isinstance(supervision, dict) or not isinstance(named := supervision.get("weakened", []), Sequence):
        return  # What is no table is refused by whoever reads it as one.
    supervision["weakened"] = [*named, *(name for name in weaker_settings(supervision) if name not in named)]


def recorded_config(table: Mapping[str, Any]) -> RunConfig:
    """The configuration of a log or of a run folder.

    Args:
        table: As TOML has it, without the table ``[run]``.

    Raises:
        ConfigurationError: It names a setting that there never was, or a value is refused.
    """
    return overlay(RunConfig(), recorded(table))


def _held(table: dict[str, Any], path: str) -> dict[str, Any]:
    """The table at a dotted name; an empty one that belongs to nothing where there is none."""
    for part in path.split("."):
        inner = table.get(part)
        if not isinstance(inner, dict):
            return {}
        table = inner
    return table


def _put(table: dict[str, Any], name: str, value: Any) -> None:
    """Set what a dotted name leads to, unless it is there."""
    *path, last = name.split(".")
    inner: Any = table
    for part in path:
        inner = inner.setdefault(part, {})
        if not isinstance(inner, dict):
            return  # What is no table is refused by whoever reads it as one.
    inner.setdefault(last, value)
