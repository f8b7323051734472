import tomllib

import numpy as np
import pytest

from palpate.adapters.config import EmulationConfig, RunConfig
from palpate.adapters.hardware import EmulatedCell, RigContext, emulated_cell
from palpate.adapters.hardware.plugins import arm_maker
from palpate.core.ports import CONTROL_RATE_HZ
from palpate.core.trial import find_ready_pose
from tests.virtual_time import VirtualTime


def test_emulated_drives_are_waited_for_longer_than_real_ones() -> None:
    config = RunConfig()
    with EmulatedCell(
        config, find_ready_pose(config.arm, config.tool.geometry, config.task), EmulationConfig(wires="cia402")
    ) as cell:
        written = cell.rig_toml()
        assert written.startswith("format = 1\n")
    table = tomllib.loads(written)["arm"]
    assert (table.pop("adapter"), table.pop("name")) == ("cia402", "zebra-zero")
    # With 3 missed SYNCs, as of real drives, a calibration on a busy computer ended again and again.
    assert table["patience"] > 5.0
    assert "leave this out for real ones" in next(line for line in written.splitlines() if "patience" in line)
    arm_maker("cia402")(table, RigContext.of(config.arm, VirtualTime()))


def test_a_wrench_is_as_old_at_any_moment_between_two_ticks_of_the_cell(monkeypatch: pytest.MonkeyPatch) -> None:
    """Held until the next it was up to one older, by chance: a latency of 20 ms was one of 22.5 between two sets."""
    monkeypatch.setattr(emulated_cell, "_HUM", (0.0,) * 6)
    config = RunConfig()
    cell = EmulatedCell(
        config, find_ready_pose(config.arm, config.tool.geometry, config.task), EmulationConfig(wires="cia402")
    )
    tick_ns = 10**9 // CONTROL_RATE_HZ
    cell.tick(tick_ns)
    before = np.array(cell.cell.before_errors)
    cell.tick(2 * tick_ns)
    now = np.array(cell.cell.before_errors)
    assert np.abs(now - before).max() > 0.0
    error = np.array(cell._felt[1]) + now
    for share in (0.0, 0.25, 1.0, 3.0):
        line = before + (0.5 + min(share, 1.0)) * (now - before)
        assert cell._wrench_source(round((2.0 + share) * tick_ns)) == pytest.approx(error - line, abs=1e-6)


def test_a_sensor_s_noise_goes_on_where_the_cell_is_held_up() -> None:
    """Readings that are equal in each digit are those of a sensor that is stuck, and end a run."""
    config = RunConfig()
    cell = EmulatedCell(
        config, find_ready_pose(config.arm, config.tool.geometry, config.task), EmulationConfig(wires="cia402")
    )
    cell.tick(10**9 // CONTROL_RATE_HZ)
    felt = np.array([cell._wrench_source(time_ns) for time_ns in range(10**8, 2 * 10**8, 10**6)])
    assert np.all(np.std(felt[:, :3], axis=0) < 0.02)
    assert len(np.unique(felt[:, 2])) == len(felt)
