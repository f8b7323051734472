"""On the way down: a wedge looks like a jam, or like the floor, until the tool wobbles."""

from math import radians
from types import SimpleNamespace

import pytest

from palpate.core.tasks.insertion_6dof import SpatialOptions
from palpate.core.tasks.insertion_6dof.insert import SpatialInsert
from palpate.core.trial import ControlConfig, TaskConfig

PRESSED = (0.0, 0.0, -4.9)
NONE = (0.0, 0.0, 0.0)


class Wedged:
    """Measurement, motion and law of a peg that presses on a wedge without a torque, until it leans one way."""

    force_N, filtered_force_z_N, reference_m = PRESSED, PRESSED[2], NONE
    axial_N_per_m, depth_step_m = 5e3, 6e-6

    def __init__(self, depth_m, frees_rad):
        self.tip_depth_m, self._frees_rad, self.turn_rad = depth_m, frees_rad, NONE

    @property
    def position_m(self):
        return 0.0, 0.0, self.tip_depth_m

    def turn(self, rate_rad_s):
        x, y, z = (a + rate / 140.0 for a, rate in zip(self.turn_rad, rate_rad_s, strict=True))
        self.turn_rad = x, y, z
        if x < -self._frees_rad:
            self.tip_depth_m = 10e-3

    def filtered_wrench_at_tip(self):
        return PRESSED, NONE

    def live_torque_at_tip_Nm(self):
        return NONE

    def velocity_m_s(self, *_):
        return NONE

    def reset(self):
        pass


def inserted(depth_m, frees_rad):
    """The last event, the depth, and the ticks of an insertion that begins wedged at that depth."""
    peg, events = Wedged(depth_m, frees_rad), [""]
    state = SimpleNamespace(
        tick=0, surface_m=0.0, slack_m=0.0, edge_m=0.0, exploration_s=0.0, report=SimpleNamespace(outcome=None),
        event=lambda name, _: events.append(name), noise=(0.1,) * 6,
    )  # fmt: skip
    equipment = SimpleNamespace(
        task=TaskConfig(depth_tolerance_mm=0.5), state=state, measurement=peg, motion=peg,
        laws=SimpleNamespace(inserting=peg), drop_m=3e-4,
    )  # fmt: skip
    axial = SimpleNamespace(restart=lambda: None, window=14, verified_since_restart=lambda: False)
    monitor = SimpleNamespace(
        supported=True, spent=False, spent_N=0.0, budget_N=25.0, contradicted=False, direction=None, contact_N=1.0,
        axial_N_per_m=5e3, press_N=4.9, axial=axial, wait=lambda *_, **__: None, push=lambda _: None,
        walled=False, presses=lambda *_: None, dither_m_s=lambda: 0.0, push_dither_m_s=lambda **_: 0.0,
    )  # fmt: skip
    phase = SpatialInsert(equipment, monitor, ControlConfig(), SpatialOptions())
    phase.enter()
    phase._walled = True
    while not phase.over and "hole" not in events:
        phase.step()
        state.tick += 1
    return events[-1], peg.tip_depth_m, state.tick


@pytest.mark.parametrize("depth_m", [9.6e-3, 5e-3])
def test_a_wedge_that_looks_like_the_floor_or_a_jam_sinks_on_as_the_tool_wobbles(depth_m):
    assert inserted(depth_m, radians(0.1))[:2] == ("hole", 10e-3)


def test_the_floor_is_wobbled_on_once_and_a_wedge_that_stays_is_stuck():
    event, _, ticks = inserted(10e-3, radians(9.0))
    assert (event, 70 < ticks < 80) == ("hole", True)
    assert inserted(5e-3, radians(9.0))[0] == "stuck"
