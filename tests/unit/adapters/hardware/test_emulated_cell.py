"""The emulated rig: its rig file, what its sensor feels, and faults at set times."""

import tomllib

import pytest

from palpate.adapters.config import EmulationConfig, RunConfig
from palpate.adapters.hardware import EVENTS, EmulatedCell, PlannedEvent, RigContext
from palpate.adapters.hardware.plugins import arm_maker
from palpate.core.errors import ConfigurationError
from palpate.core.trial import find_ready_pose
from tests.virtual_time import VirtualTime

_S = 10**9


def emulated(arm, *events, **devices):
    config = RunConfig(arm=arm)
    ready = find_ready_pose(config.arm, config.tool.geometry, config.task)
    return EmulatedCell(config, ready, EmulationConfig(**devices), events=events)


def test_emulated_drives_are_waited_for_longer_than_real_ones():
    with emulated("zebra-zero", wires="cia402") as cell:
        written = cell.rig_toml()
        assert written.startswith("format = 2\n")
    table = tomllib.loads(written)["arm"]
    assert (table.pop("adapter"), table.pop("name")) == ("cia402", "zebra-zero")
    # With 3 missed SYNCs, as of real drives, a calibration on a busy computer ended again and again.
    assert table["timeout_scale"] > 5.0
    assert "leave this out for real ones" in next(line for line in written.splitlines() if "timeout_scale" in line)
    arm_maker("cia402")(table, RigContext.of("zebra-zero", VirtualTime()))


def test_event_counts_from_the_start_or_from_the_first_motion():
    names = ("program-end", "cable-pulled")
    from_motion, from_start = (PlannedEvent.of(text, names) for text in ("2s:program-end", "start+3.5s:cable-pulled"))
    assert [from_start.due(5 * _S + late, 5 * _S, 0) for late in (0, 34 * _S // 10, 35 * _S // 10)] == [0, 0, 1]
    assert [from_motion.due(now_s * _S, 5 * _S, moved) for now_s, moved in ((9, 0), (10, 9 * _S), (11, 9 * _S))] == [
        False, False, True,
    ]  # fmt: skip


@pytest.mark.parametrize("text", ["12:program-end", "s:program-end", "12s:fire", "-1s:program-end", "12s"])
def test_unknown_event_is_refused(text):
    with pytest.raises(ConfigurationError, match="such as 12s:program-end or start\\+12s:program-end, with one of"):
        PlannedEvent.of(text, ("program-end",))


def test_rig_has_the_events_that_its_devices_can_show():
    every = {name: emulated("ur5", f"1s:{name}") for name in EVENTS}
    assert list(every) == list(EVENTS)
    with pytest.raises(ConfigurationError, match="one of emergency-stop, cable-pulled, sensor-silent, sensor-cable,"):
        emulated("zebra-zero", "1s:program-end")
    with pytest.raises(ConfigurationError, match="which these devices can show"):
        emulated("ur5", "1s:sensor-silent", force="ur-rtde")


def test_events_happen_while_the_cell_lives():
    happened = []
    made = emulated("ur5", "start+0.05s:protective-stop")
    with made:
        made.run(lambda: bool(happened), lambda truth: None, lambda event: happened.append(event.name))
        with made.arm.hold() as controller:
            assert controller.safety_mode.name == "PROTECTIVE_STOP"
