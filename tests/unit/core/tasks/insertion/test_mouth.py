"""A first touch in the mouth of the hole lowers the surface, and a peg on the floor seems short of its depth."""

from palpate.adapters.config import compose
from palpate.adapters.experiments.planning import run_series

JOB = {
    "part": {
        "peg_mm": 46.8, "hole_mm": 46.824, "depth_mm": 12.0, "chamfer_mm": 0.5, "friction_max": 0.2,
        "depth_tolerance_mm": 0.2,
    },
    "tool": {
        "mass_kg": 1.25, "rigid_mass_kg": 0.05, "axial_N_per_mm": 8.0, "lateral_N_per_mm": 64.0,
        "tilt_Nm_per_rad": 80.0, "torsion_Nm_per_rad": 80.0,
    },
    "arm": {"name": "ur3"},
    "place": {"position_uncertainty_mm": 0.6, "tilt_uncertainty_mrad": 4.8},
    "cell": {
        "peg": {"friction": 0.11}, "tilt_mrad": 4.8,
        "sensor": {"force_noise_N": 0.36, "torque_noise_Nm": 0.0144},
    },
}  # fmt: skip


def test_a_peg_on_the_floor_comes_up_and_counts():
    config = compose("job", "belief", job=JOB, task="insertion")
    outcomes = [(each.outcome, each.success) for each in run_series(config, "", range(4))]
    assert outcomes == [("inserted", True)] * 4
