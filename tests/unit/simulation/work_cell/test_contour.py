"""The contour's boxes lie along the wave, and only beside contacts that are searched for."""

import mujoco
import numpy as np
import pytest

from palpate.core.errors import ConfigurationError
from palpate.simulation.work_cell import CellConfig
from palpate.simulation.work_cell.contour import ContourConfig, add_contour, height_m

WAVE = ContourConfig(shape="sine", amplitude_mm=2.0, wavelength_mm=20.0, length_mm=60.0)


def test_the_surface_is_the_wave_to_a_few_micrometres() -> None:
    spec = mujoco.MjSpec()
    # Its z points into the surface.
    add_contour(spec.worldbody.add_body(name="plate", quat=(0.0, 1.0, 0.0, 0.0)), WAVE)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    hit = np.zeros(1, dtype=np.int32)
    for x_m in np.arange(-0.025, 0.025, 0.00037):
        above = mujoco.mj_ray(model, data, np.array([x_m, 0.0, 0.1]), np.array([0.0, 0.0, -1.0]), None, 1, -1, hit)
        assert 0.1 - above == pytest.approx(height_m(WAVE, x_m), abs=3e-5)


def test_contacts_are_not_listed_beside_a_contour() -> None:
    with pytest.raises(ConfigurationError, match="searched, with a contour"):
        CellConfig(contour=WAVE)
