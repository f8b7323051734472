"""How far a hole may be turned for a peg to drop in does not hang on the time step."""

import pytest

from palpate.simulation.work_cell.config import PegConfig
from tests.integration.physics.bench import Bench, quiet


@pytest.mark.parametrize("section", ["square", "triangle"])
def test_half_the_time_step_changes_capture_in_yaw_by_less_than_a_fifth(section: str) -> None:
    yaw_deg = []
    for substeps in (4, 8):
        with Bench(quiet(peg=PegConfig(cross_section=section), substeps=substeps)) as bench:
            yaw_deg.append(bench.capture_in_yaw_deg(0.05))
    assert yaw_deg[1] == pytest.approx(yaw_deg[0], rel=0.2)
    assert 0.1 < yaw_deg[0] < 2.0
