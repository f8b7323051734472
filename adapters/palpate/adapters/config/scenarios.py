"""Settings presets: ``paper``, ``blind``, and ``blind`` with one further condition.

``docs/how-to/choose-conditions.md`` lists them.
"""

from collections.abc import Mapping
from typing import Any, Final, TypeAlias

from palpate.core.job import SIDES

Table: TypeAlias = Mapping[str, Any]

_KGF_MM_IN_NM: Final = 0.00980665
_DRAWN: Final = {"zero_heading": "drawn"}
_TILT: Final = {"tilt_heading": "drawn"}
_ONE_GRIP: Final = {"grip_trials": 0}
_TURNED: Final = _TILT | {"grip_trials": 1, "plate_tilt_mrad": 17.5}
_PLATE: Final = {
    "tilt_mrad": 0.0,
    "conditions": {"tilt_heading": "set", "grip_trials": 0, "plate_tilt_mrad": 17.5},
}
_BIAS: Final = _DRAWN | {"zero_shift_Nm": round(3.0 * _KGF_MM_IN_NM, 6)}
_DRIFT: Final = _DRAWN | {"zero_drift_Nm_s": round(3.0 * _KGF_MM_IN_NM / 20.0, 6)}
_CORNER: Final = {"x_mm": 283.0, "y_mm": 283.0}

JOB: Final = "job"
"""Name of the scenario that leaves a job unchanged."""
BLIND: Final[Table] = {"place": {"position_uncertainty_mm": 3.0, "start_uncertainty_mm": 3.0}}
"""Base for all scenarios except ``paper`` and ``job``: the hole lies anywhere within 3 mm of the nominal goal."""

SCENARIOS: Final[Mapping[str, Table]] = {
    "paper": {},
    "blind": {},
    "blind-tilt-2": {"place": {"tilt_uncertainty_mrad": 2.0}, "cell": {"conditions": _TILT | _ONE_GRIP}},
    "blind-tilt-4": {"place": {"tilt_uncertainty_mrad": 4.0}, "cell": {"conditions": _TILT | _ONE_GRIP}},
    "blind-regrip": {"place": {"tilt_uncertainty_mrad": 4.0}, "cell": {"conditions": _TILT | {"grip_trials": 20}}},
    "blind-bias": {"cell": {"conditions": _BIAS}},
    "blind-bias-drawn": {"cell": {"conditions": _BIAS | {"zero_trials": 1}}},
    "blind-drift": {"cell": {"conditions": _DRIFT | {"zero_trials": 1}}},
    "blind-noise": {"cell": {"sensor": {"force_noise_N": 0.3, "torque_noise_Nm": 0.012}}},
    "blind-batches": {
        "cell": {"hole_uncertainty_mm": 0.5, "conditions": {"hole_shift_mm": 2.5, "hole_shift_trials": 20}}
    },
    "blind-wear": {"cell": {"conditions": {"wear_mm": 0.075, "wear_trials": 50}}},
    "blind-corner": {"place": _CORNER},
    "blind-smooth": {"cell": {"peg": {"friction": 0.1}}},
    "blind-rough": {"cell": {"peg": {"friction": 0.4}}},
    "blind-tight": {"part": {"hole_mm": 29.08}},
    "blind-5": {"place": {"position_uncertainty_mm": 5.0}},
    "blind-grip": {"place": {"tilt_uncertainty_mrad": 4.0}},
    "blind-plate": {"place": {"tilt_uncertainty_mrad": 17.5}, "cell": _PLATE},
    "blind-yaw": {"part": {"shape": "square"}, "place": {"yaw_uncertainty_deg": 5.0}},
    **{
        f"blind-{shape}": {
            "part": {"shape": shape},
            "place": {"tilt_uncertainty_mrad": 21.5, "yaw_uncertainty_deg": 5.0},
            "cell": {"tilt_mrad": 4.0, "conditions": _TURNED},
        }
        for shape in SIDES
    },
    JOB: {},
}
"""Settings by preset name, applied over ``BLIND`` except for ``paper`` and ``job``."""

LEARNERS: Final[Mapping[str, Table]] = {
    "q-learning": {},
    "sarsa": {},
    "belief": {
        "task": {"ticks_per_action": 4, "motion_duty": 1.0},
        "perception": {"cutoff_Hz": 10.0},
    },
    "hmm": {"learning": {"hmm": {"reach": 20, "lattice": 3}}},
    "options": {
        "perception": {"symbols": "options", "memory": "last-action"},
        "learning": {
            "alpha": 0.7, "alpha_visits": 3.0, "alpha_floor": 0.1, "initial_value": -22.0, "optimistic_prior": 30.0,
            "temperature": 2.0, "temperature_decay": 0.85, "trace_decay": 0.6, "reinforcement": "time",
        },
    },
}  # fmt: skip
"""Preset for each learner: suitable action time, filter, states and rates."""
