"""Faults of emulated devices at set times: when they come, and what then reaches a run."""

import pytest

from palpate.adapters.config import EmulationConfig, RunConfig
from palpate.adapters.hardware import EVENTS, EmulatedCell, PlannedEvent
from palpate.core.errors import ConfigurationError
from palpate.core.trial import find_ready_pose

_S = 10**9


def test_an_event_counts_from_the_start_or_from_the_first_motion() -> None:
    names = ("program-end", "cable-pulled")
    from_motion, from_start = (PlannedEvent.of(text, names) for text in ("2s:program-end", "start+3.5s:cable-pulled"))
    assert [from_start.due(5 * _S + late, 5 * _S, 0) for late in (0, 34 * _S // 10, 35 * _S // 10)] == [0, 0, 1]
    assert [from_motion.due(now_s * _S, 5 * _S, moved) for now_s, moved in ((9, 0), (10, 9 * _S), (11, 9 * _S))] == [
        False, False, True,
    ]  # fmt: skip


@pytest.mark.parametrize("text", ["12:program-end", "s:program-end", "12s:fire", "-1s:program-end", "12s"])
def test_what_is_no_event_is_refused(text: str) -> None:
    with pytest.raises(ConfigurationError, match="as in 12s:program-end or start\\+12s:program-end, with one of"):
        PlannedEvent.of(text, ("program-end",))


def cell(arm: str, *events: str, **devices: str) -> EmulatedCell:
    config = RunConfig(arm=arm)
    ready = find_ready_pose(config.arm, config.tool.geometry, config.task)
    return EmulatedCell(config, ready, EmulationConfig(**devices), events=events)  # type: ignore[arg-type]


def test_a_rig_has_the_events_that_its_devices_can_show() -> None:
    every = {name: cell("ur5", f"1s:{name}") for name in EVENTS}
    assert list(every) == list(EVENTS)
    with pytest.raises(ConfigurationError, match="one of emergency-stop, cable-pulled, sensor-silent, sensor-cable,"):
        cell("zebra-zero", "1s:program-end")
    with pytest.raises(ConfigurationError, match="which these devices can show"):
        cell("ur5", "1s:sensor-silent", force="ur-rtde")


def test_events_happen_while_the_cell_lives(monkeypatch: pytest.MonkeyPatch) -> None:
    happened: list[str] = []
    made = cell("ur5", "start+0.05s:protective-stop")
    with made:
        made.run(lambda: bool(happened), lambda truth: None, lambda event: happened.append(event.name))
        with made.ur.exclusive() as controller:
            assert controller.safety_mode.name == "PROTECTIVE_STOP"
