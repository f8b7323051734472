"""The rig file of an emulated cell."""

import tomllib

from palpate.adapters.config import EmulationConfig, RunConfig
from palpate.adapters.hardware.cia402 import make_cia402
from palpate.adapters.hardware.emulated_cell import EmulatedCell
from palpate.adapters.hardware.plugins import RigContext
from palpate.core.trial import find_ready_pose
from tests.virtual_time import VirtualTime


def test_emulated_drives_are_waited_for_longer_than_real_ones() -> None:
    config = RunConfig()
    with EmulatedCell(config, find_ready_pose(config.arm, config.task), EmulationConfig(arm="cia402")) as cell:
        written = cell.rig_toml()
    table = tomllib.loads(written)["arm"]
    assert table.pop("adapter") == "cia402"
    # With 3 missed SYNCs, as of real drives, a calibration on a busy computer ended again and again.
    assert table["patience"] > 5.0
    assert "leave this out for real ones" in next(line for line in written.splitlines() if "patience" in line)
    make_cia402(table, RigContext.of(config.arm, VirtualTime()))
