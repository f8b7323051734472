"""The presets that settings start from: ``paper``, ``blind``, and ``blind`` with one condition more.

``docs/how-to/choose-conditions.md`` is their table.
"""

from collections.abc import Mapping
from typing import Any, Final, TypeAlias

from palpate.simulation.work_cell import SIDES

Table: TypeAlias = Mapping[str, Any]

_KGF_MM_IN_NM: Final = 0.00980665
_DRAWN: Final = {"zero_heading": "drawn"}
_TILT: Final = {"tilt_heading": "drawn"}
_GRIPPED: Final = _TILT | {"grip_trials": 1}
_TURNED: Final = _GRIPPED | {"yaw_deg": 5.0, "plate_lean_mrad": 17.5}
_BIAS: Final = _DRAWN | {"zero_shift_Nm": round(3.0 * _KGF_MM_IN_NM, 6)}
_DRIFT: Final = _DRAWN | {"zero_drift_Nm_s": round(3.0 * _KGF_MM_IN_NM / 20.0, 6)}
_CORNER: Final = {"x_mm": 283.0, "y_mm": 283.0}

BLIND: Final[Table] = {"cell": {"hole_uncertainty_mm": 3.0}, "perception": {"position_threshold_mm": 50.0}}
"""What all but ``paper`` begin with: the hole itself lies anywhere within 3 mm of the nominal goal.

The paper's symbols are of torque near the nominal goal only; here the hole may be anywhere in the area.
"""

SCENARIOS: Final[Mapping[str, Table]] = {
    "paper": {},
    "blind": {},
    "blind-tilt-2": {"cell": {"tilt_mrad": 2.0, "conditions": _TILT}},
    "blind-tilt-4": {"cell": {"tilt_mrad": 4.0, "conditions": _TILT}},
    "blind-regrip": {"cell": {"tilt_mrad": 4.0, "conditions": _TILT | {"grip_trials": 20}}},
    "blind-bias": {"cell": {"conditions": _BIAS}},
    "blind-bias-drawn": {"cell": {"conditions": _BIAS | {"zero_trials": 1}}},
    "blind-drift": {"cell": {"conditions": _DRIFT | {"zero_trials": 1}}},
    "blind-noise": {"cell": {"sensor": {"force_noise_N": 0.3, "torque_noise_Nm": 0.012}}},
    "blind-batches": {
        "cell": {"hole_uncertainty_mm": 0.5, "conditions": {"hole_shift_mm": 2.5, "hole_shift_trials": 20}}
    },
    "blind-wear": {"cell": {"conditions": {"wear_mm": 0.075, "wear_trials": 50}}},
    "blind-corner": {"task": {"goal": _CORNER}},
    "blind-smooth": {"cell": {"peg": {"friction": 0.1}}},
    "blind-rough": {"cell": {"peg": {"friction": 0.4}}},
    "blind-tight": {"cell": {"peg": {"clearance_mm": 0.04}}},
    "blind-5": {"cell": {"hole_uncertainty_mm": 5.0}, "task": {"area_half_width_mm": 5.5}},
    "blind-grip": {"cell": {"tilt_mrad": 4.0, "conditions": _GRIPPED}},
    "blind-plate": {"cell": {"conditions": {"plate_lean_mrad": 17.5}}},
    "blind-yaw": {"cell": {"peg": {"cross_section": "square"}, "conditions": {"yaw_deg": 5.0}}},
    **{
        f"blind-{shape}": {"cell": {"tilt_mrad": 4.0, "peg": {"cross_section": shape}, "conditions": _TURNED}}
        for shape in SIDES
    },
}
"""Settings by the preset's name; over ``BLIND``, except for ``paper``."""

LEARNERS: Final[Mapping[str, Table]] = {
    "q-learning": {},
    "sarsa": {},
    # A heave of drawn strokes is as loud as a touch: in blind the 95th percentile of times grew by a fifth.
    "belief": {
        "task": {"ticks_per_action": 4, "moving_share": 1.0, "uneven_heave": False},
        "perception": {"cutoff_Hz": 10.0},
    },
    "hmm": {"learning": {"hmm": {"reach": 20, "lattice": 3}}},
    "skills": {
        "perception": {"symbols": "skills", "memory": "last-action"},
        "learning": {
            "alpha": 0.7, "alpha_visits": 3.0, "alpha_floor": 0.1, "initial_value": -22.0, "rule_lead": 30.0,
            "temperature": 2.0, "temperature_decay": 0.85, "trace_decay": 0.6, "reinforcement": "time",
        },
    },
}  # fmt: skip
"""What each learner begins with: time of an action, filter, states and rates that suit it, over the scenario's."""
SUITED: Final[Mapping[tuple[str, str], Table]] = {("blind-noise", "belief"): {"task": {"press_kgf": 0.8}}}
"""The same in one scenario: a torque grows with the pressing force, and the noise of the sensor does not."""
