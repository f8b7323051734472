"""Settings of the simulated cell that follow from a job."""

from dataclasses import replace

from palpate.core.job import Job, ToolConfig, derived_settings
from palpate.core.ports import SensorFacts

SENSOR = SensorFacts(0.1, 0.004)


def test_a_light_peg_in_a_stiff_gripper_is_simulated_in_shorter_steps() -> None:
    stiff = replace(ToolConfig(), mass_kg=0.17, rigid_mass_kg=0.05, lateral_N_per_mm=52.4)
    cell = derived_settings(replace(Job(), tool=stiff), SENSOR, "insertion")["cell"]
    # 661 rad/s at 140 Hz, over 0.652 rad.
    assert (cell["substeps"], cell["leaning_impedance"]) == (8, 0.965)
    assert derived_settings(Job(), SENSOR, "insertion")["cell"]["substeps"] == 4


def test_a_peg_that_slips_further_than_its_clearance_is_simulated_in_shorter_steps() -> None:
    job = Job()
    tight = replace(job, part=replace(job.part, peg_mm=4.2, hole_mm=4.224, friction_max=0.6))
    soft = replace(tight, tool=replace(job.tool, mass_kg=0.26, rigid_mass_kg=0.05, lateral_N_per_mm=22.8))
    # 0.6 * 9.62 N / sqrt(22.8 N/mm * 0.21 kg) / 140 Hz over 5 * 0.012 mm.
    noisy = SensorFacts(0.37, 0.004)
    assert derived_settings(soft, noisy, "insertion")["cell"]["substeps"] == 10


def test_a_sensors_range_bounds_the_derived_torque_limit() -> None:
    weak = replace(SENSOR, range_Nm=(8.0, 5.0, 8.0))
    limits = [derived_settings(Job(), sensor, "insertion")["supervision"]["max_torque_Nm"] for sensor in (SENSOR, weak)]
    assert limits == [5.0, 4.5]
