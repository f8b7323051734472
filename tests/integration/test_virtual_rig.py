"""Rigs in virtual time: real drivers and emulated devices, and a trial over their wires as `palpate gap` reads it."""

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import pytest

from palpate.adapters.config import overlay, scenario, task_kind
from palpate.adapters.experiments import ChosenPolicy, RunFolder, ready_pose, run_chosen
from palpate.adapters.log import read_log
from palpate.adapters.replay import find_logs, gap_cell
from palpate.core.errors import DeviceError
from palpate.core.trial import Outcome, find_ready_pose
from palpate.simulation.work_cell import HiddenValues
from tests.virtual_rig import VirtualRig

LATE = HiddenValues(springs_share=0.7, friction=0.35, latency_ms=20.0)


@pytest.mark.parametrize(
    ("kind", "arm", "force", "age_ticks"),
    [
        ("zebra-zero", "zebra-nmc", "jr3-uart", (1.0, 1.7)),
        ("zebra-zero", "cia402", "jr3-can", (0.7, 1.7)),
        ("ur5", "ur5-rtde", "ati-netft", (0.0, 1.0)),
    ],
)
def test_a_trial_over_virtual_wires_is_inserted_and_tells_how_old_its_angles_are(
    kind: str, arm: str, force: str, age_ticks: tuple[float, float], tmp_path: Path
) -> None:
    springs = {"control": {"axial_stiffness_N_per_mm": 3.5}}
    config = overlay(replace(scenario("paper"), seed=3, arm=kind), springs)
    ready, chosen = find_ready_pose(config.arm, config.task), ChosenPolicy("torque", config)
    with ExitStack() as opened, VirtualRig(config, ready, arm, force, LATE, phase=0.4) as rig:
        run_chosen(chosen, config, ready, rig, 1, recorder=RunFolder(tmp_path).recorder(config.recording, opened))
    (path,) = find_logs([str(tmp_path)])
    end = read_log(path).end
    assert end is not None
    assert end.outcome == Outcome.INSERTED.value
    trial = gap_cell.driven_from(path)
    assert trial.late == ""
    assert age_ticks[0] < trial.joints_age_ticks < age_ticks[1]


def test_a_sensor_without_news_ends_the_trial_by_its_name() -> None:
    config = replace(scenario("paper"), seed=3, arm="ur5")
    ready, chosen = find_ready_pose(config.arm, config.task), ChosenPolicy("torque", config)
    with VirtualRig(config, ready, "ur5-rtde", "ati-netft", HiddenValues()) as rig:
        clock = rig.desk.clock
        rig.cell.box.box.network = lambda datagrams: [] if 25 <= clock.now_ns() // 10**8 < 27 else datagrams
        with pytest.raises(
            DeviceError, match=r"^rig: trial 0: SAMPLE_.* \(ATI Net F/T: has sent nothing for 2.. ms; check"
        ):
            run_chosen(chosen, config, ready, rig, 1)


def test_squares_go_in_one_after_the_other_on_an_arm_that_lags(tmp_path: Path) -> None:
    """The second begins in the hole, with a turned tool; each pushes at walls with an arm 20 to 35 ms behind."""
    config = overlay(
        overlay(scenario("paper"), task_kind("insertion-6dof").preset),
        {
            "seed": 51001,
            "task": {"name": "insertion-6dof", "options": {"corners": 4.0, "corner_mm": 20.5}},
            "cell": {
                "tilt_mrad": 4.0, "hole_uncertainty_mm": 3.0, "peg": {"cross_section": "square"},
                "conditions": {
                    "tilt_heading": "drawn", "grip_trials": 1, "yaw_deg": 5.0, "plate_lean_mrad": 17.5
                },
            },
        },
    )  # fmt: skip
    ready, chosen = ready_pose(config), ChosenPolicy("corner-first", config)
    with ExitStack() as opened, VirtualRig(config, ready, "zebra-nmc", "jr3-uart", HiddenValues(), phase=0.4) as rig:
        run_chosen(chosen, config, ready, rig, 2, recorder=RunFolder(tmp_path).recorder(config.recording, opened))
    ends = [read_log(path).end for path in find_logs([str(tmp_path)])]
    assert [end and end.outcome for end in ends] == [Outcome.INSERTED.value] * 2
