"""The simulated cell under a rig's recorded commands, and the cell that fits best."""

import re
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.config import overlay, scenario
from palpate.adapters.experiments import ChosenPolicy, RunFolder, run_chosen
from palpate.adapters.log import read_log
from palpate.adapters.mujoco import SimulatedRig
from palpate.adapters.replay import (
    find_logs,
    gap,
    gap_cell,
    gap_fit,
    gap_lag,
    gap_late,
    gap_numbers,
    gap_of,
    gap_wall,
    gaps_of,
)
from palpate.core.errors import ConfigurationError, LogError
from palpate.core.trial import find_ready_pose
from palpate.simulation.work_cell import HiddenValues
from tests.command_line import CommandLine
from tests.support.log_surgery import changed, indices, messages_of, write_log

CONFIG = replace(scenario("paper"), seed=11)
READY = find_ready_pose(CONFIG.arm, CONFIG.task)
OTHER = HiddenValues(springs_share=0.7, friction=0.35, latency_ms=20.0)
TRUE = np.array([0.35, 0.7, 0.7, 0.7, 0.0, 2.8])
NOTHING = gap.AxisErrors(np.zeros(6), np.zeros(6))
ANY_GAP = gap.Gap(CONFIG, 1, {}, NOTHING, NOTHING, TRUE, TRUE, 20.0, 0.0, 0.0, 0.1, 0.004, {}, np.empty(0))


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Trials of a cell that is other than its configuration."""
    return recorded_in(tmp_path_factory.mktemp("gap"), OTHER)


def recorded_in(folder: Path, other: HiddenValues) -> list[Path]:
    chosen = ChosenPolicy("torque", CONFIG)
    with ExitStack() as opened, SimulatedRig(CONFIG, READY, other) as rig:
        run_chosen(chosen, CONFIG, READY, rig, 2, recorder=RunFolder(folder).recorder(CONFIG.recording, opened))
    return find_logs([str(folder)])


@pytest.fixture
def hurried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fits of less than they could be made of."""
    monkeypatch.setattr(gap_cell, "_MOST_TICKS", 100)
    monkeypatch.setattr(gap_fit, "_PASSES", 1)
    monkeypatch.setattr(gap_fit, "_FRICTIONS", 3)


def test_the_cell_gives_a_recorded_trial_again_when_it_is_as_the_rig_was(logs: list[Path]) -> None:
    trial = gap_cell.driven_from(logs[0])
    wrench, joints = gap_cell.drive(trial, TRUE)
    touch = slice(gap_cell.SETTLED.start, gap_cell.FREE_TICKS + gap_fit.TOUCH_TICKS)
    rest = (trial.wrench - gap_cell.late(wrench, 2.8))[touch]
    # What is left is the sensor's noise.
    assert rest.std(axis=0) == pytest.approx([0.1] * 3 + [0.004] * 3, rel=0.35)
    assert np.abs(trial.joints_rad - joints).max() < 1e-4


@pytest.mark.usefixtures("hurried")
def test_stiffness_friction_and_latency_are_found(logs: list[Path]) -> None:
    found = gap_of(logs, lambda: None)
    friction, axial, across, _, plate_mm, _ = found.values
    assert [friction, axial, found.wrench_late_ms] == pytest.approx([0.35, 0.7, 20.0], rel=0.1)
    assert (across, plate_mm) == (pytest.approx(0.7, rel=0.2), pytest.approx(0.0, abs=0.05))
    assert found.after.wrench[2] < 0.3 * found.before.wrench[2]
    assert found.noise_N == pytest.approx(0.1, rel=0.15)
    cell = overlay(CONFIG, found.settings).cell
    assert (cell.peg.friction, cell.compliance.axial_N_per_mm) == pytest.approx((friction, 5.0 * axial), rel=1e-3)


@pytest.mark.usefixtures("hurried")
def test_a_reference_tells_how_much_later_wrenches_come(logs: list[Path], palpate: CommandLine) -> None:
    recorded_in(Path("bare"), replace(OTHER, latency_ms=0.0))
    told = palpate.succeed("gap", *logs, "--reference", "bare")
    found = re.search(r"wrenches come ([\d.]+) ± [\d.]+ ms later than in bare", told)
    assert found is not None, told
    assert float(found[1]) == pytest.approx(20.0, rel=0.1)
    left = re.search(r"([\d.]+) N along the tool are left there, ([\d.]+) N here", told)
    assert left is not None, told
    assert float(left[1]) < 1.5 * float(left[2])


def test_a_peg_that_sank_and_was_not_inserted_is_doubted(logs: list[Path], tmp_path: Path) -> None:
    """Its hole is taken to be at the goal: pegs that came to rest 0.07 mm beside it made friction 0.07 of 0.35."""
    messages = messages_of(logs[0])
    (end,) = indices(messages, "/end")
    tripped = changed(messages, end, lambda made: setattr(made, "outcome", "safety trip"))
    found = gap_cell.driven_from(write_log(tmp_path / "tripped.mcap", tripped))
    assert (gap_cell.driven_from(logs[0]).doubted, found.doubted) == ("", "hole")


@pytest.mark.usefixtures("hurried")
def test_walls_that_mislead_do_not_change_the_delay_of_a_reference(logs: list[Path]) -> None:
    """Its friction, stiffnesses and damping are known: what it says of them is not asked."""
    trials = [gap_cell.driven_from(path) for path in logs]
    misleading = [
        replace(trial, walled=replace(trial.walled, force_N=1.4 * trial.walled.force_N))
        for trial in trials
        if trial.walled
    ]
    assert len(misleading) == 2
    fit = gap_fit.CellFit(misleading, lambda: None)
    sds = fit.run_as(TRUE)
    assert fit.values[:4].tolist() == TRUE[:4].tolist()
    assert fit.values[gap_cell.LATE] == pytest.approx(TRUE[gap_cell.LATE], abs=0.15)
    assert 0.0 < sds[gap_cell.LATE] < 0.5


def test_one_wall_tells_the_stiffness_across_and_none_leaves_it_open(logs: list[Path], hurried: None) -> None:
    """Little is felt across until a peg slips: asked of that, 0.7 was read as 1.5 with a small deviation."""
    first, second = (gap_cell.driven_from(path) for path in logs)
    fit = gap_fit.CellFit([first, replace(second, walled=None)], lambda: None)
    sds = fit.run()
    assert fit.values[2] == pytest.approx(0.7, rel=0.2)
    assert 0.05 < sds[2] / fit.values[2] < 0.12
    fit = gap_fit.CellFit([replace(trial, walled=None) for trial in (first, second)], lambda: None)
    sds = fit.run()
    assert (fit.values[2], sds[2]) == (pytest.approx(fit.values[1], rel=0.05), np.inf)


def test_of_two_sets_each_counts_as_much_as_its_deviations_say_and_each_wall_as_any_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One of them may be misread as a whole, and need not be the reference; three walls may agree by chance."""
    told = {"new": ([0.3, 0.6, 0.69, 0.5], [0.01, 0.03, 0.04, 0.1], [0.66, 0.69, 0.7, 1.2]),
            "old": ([0.4, 0.7, 0.6, 0.9], [0.01, 0.01, 0.01, 0.1], [0.6, 0.6, 0.61])}  # fmt: skip
    shared = []

    def fitted(trials: list[str], lag: float, gone_through: object, same: Any = None) -> Any:
        values, sds = (np.array([*each, 0.0, 3.0]) for each in told[trials[0]][:2])
        shared.append(same)
        return replace(ANY_GAP, values=values, sds=sds, walls=np.array(told[trials[0]][2]))

    monkeypatch.setattr(gap, "_fitted", fitted)
    monkeypatch.setattr(gap, "_driven", lambda paths: [str(path) for path in paths])
    monkeypatch.setattr(gap, "_followed", lambda trials, _: (trials, 0.0))
    monkeypatch.setattr(gap, "_require_alike", lambda *_: None)
    gaps_of([Path("new")], [Path("old")], lambda: None)
    assert shared[:2] == [None, None]
    assert shared[2] is shared[3]
    assert shared[2].values[:4] == pytest.approx([0.35, 0.69, 0.66, 0.7])
    assert shared[2].sds[:2] == pytest.approx([0.01 / np.sqrt(2.0), 0.01 * np.sqrt(0.9)])
    assert 0.03 < shared[2].sds[2] < 0.05
    told["new"][2].clear()
    told["old"][2].clear()
    told["new"][1][2] = told["old"][1][2] = np.inf
    gaps_of([Path("new")], [Path("old")], lambda: None)
    assert (shared[6].values[2], shared[6].known(2)) == (pytest.approx(0.69), False)


def test_with_which_moment_of_a_bus_cycle_ticks_fall_together_is_no_latency(logs: list[Path]) -> None:
    """A command that waits a tick longer for its bus comes with angles that are a tick younger."""
    trial = replace(gap_cell.driven_from(logs[0]), joints_age_ticks=1.4)
    waited = replace(trial, wrench=gap_cell.late(trial.wrench, 1.0), joints_age_ticks=0.4)
    fits = [gap_fit.CellFit([each], lambda: None) for each in (trial, waited)]
    for fit in fits:
        fit.values = TRUE.copy()
        fit.fit_delay()
    sooner, later = fits
    assert later.values[gap_cell.LATE] - sooner.values[gap_cell.LATE] == pytest.approx(1.0, abs=0.05)
    assert later.with_age_ticks == pytest.approx(sooner.with_age_ticks, abs=0.05)


def test_an_arm_that_smoothes_its_set_points_is_driven_so(logs: list[Path]) -> None:
    """As servoj's look-ahead does: a lag is no delay, and what is felt as the peg touches comes of it."""
    trial = gap_cell.driven_from(logs[0])
    smooth = replace(trial, command_rad=gap_lag.smoothed(trial.command_rad, 4.2))
    wrench, q_rad = gap_cell.drive(smooth, TRUE)
    seen = replace(trial, wrench=gap_cell.late(wrench, 2.8), joints_rad=gap_cell.late(q_rad, 0.7))
    (followed, _), lag = gap._followed([seen, seen], lambda: None)
    assert lag == pytest.approx(4.2, abs=0.2)
    assert np.abs(followed.command_rad - smooth.command_rad).max() < 2e-4
    assert gap._followed([trial], lambda: None)[1] == 0.0


@given(st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=9), st.floats(-100.0, 100.0))
def test_the_middle_of_delays_is_among_them_and_not_moved_by_one_that_is_off(near: list[float], off: float) -> None:
    assert min(near) <= gap_numbers.middle_of(np.array(near)) <= max(near)
    assert abs(gap_numbers.middle_of(np.array([*near, off]))) <= 1.0


def test_friction_is_found_where_traces_are_out_of_step(logs: list[Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """Over a hole that is some micrometres from where it is believed pegs stick and slip at other times."""
    monkeypatch.setattr(gap_fit, "_FRICTIONS", 3)
    trial = gap_cell.driven_from(logs[0])
    fit = gap_fit.CellFit([replace(trial, hole_m=(x * 1e-5, 0.0)) for x in (-4, -2, 2, 4)], lambda: None)
    fit.values = np.array([0.2, *TRUE[1:]])
    sd = fit.fit_friction()
    assert fit.values[0] == pytest.approx(0.35, rel=0.1)
    assert abs(fit.values[0] - 0.35) < 2.0 * sd < 0.1


def test_deviations_hold_where_the_errors_of_a_trial_hang_together() -> None:
    rng = np.random.default_rng(5)
    slopes, found, told = rng.uniform(0.5, 1.5, 20), [], []
    for _ in range(200):
        jacobians = [np.full((50, 1), slope) for slope in slopes]
        rests = [rng.normal(0.0, 1.0, 50) + rng.normal(0.0, 1.0) for _ in slopes]
        normal, parts = gap_numbers.normal_equations(jacobians, rests)
        found.append(float(parts.sum() / normal[0, 0]))
        told.append(float(gap_numbers.deviations(normal, parts, rests)[0]))
    assert np.mean(told) == pytest.approx(np.std(found), rel=0.2)


@given(st.floats(0.0, 9.0))
def test_a_trace_is_put_off_by_any_time(ticks: float) -> None:
    trace = np.arange(40.0)[:, None]
    assert gap_cell.late(trace, ticks)[:, 0] == pytest.approx(np.maximum(trace[:, 0] - ticks, 0.0))


def test_a_wall_tells_stiffness_and_hole_from_angles_that_come_earlier() -> None:
    rng = np.random.default_rng(4)
    led_mm = np.array([0.5, 0.2]) * np.clip(np.linspace(1.2, -0.1, 60), 0.0, 1.0)[:, None]
    aside = led_mm - [0.02, -0.03]
    away = np.hypot(*aside.T)[:, None]
    force = -28.0 * np.maximum(away - 0.075, 0.0) * aside / away
    late = gap_cell.late(force, 3.0) + rng.normal(0.0, 0.1, force.shape)
    found = gap_wall.held_by(gap_wall.Walled(led_mm, late, 0.075), 3.0)
    assert found is not None
    assert found[0] == pytest.approx(28.0, rel=0.02)
    assert found[1] * 1e3 == pytest.approx([0.02, -0.03], abs=0.01)
    assert gap_wall.held_by(gap_wall.Walled(led_mm, 0.1 * late, 0.075), 3.0) is None


def test_a_peg_that_slips_down_its_wall_reads_no_softer() -> None:
    led_mm = np.array([0.5, 0.2]) * np.clip(np.linspace(1.2, -0.1, 60), 0.0, 1.0)[:, None]
    away = np.hypot(*led_mm.T)[:, None] + 1e-9
    force = -28.0 * np.maximum(away - 0.075, 0.0) * led_mm / away
    force[8:48] *= np.tile([0.4, 0.6, 0.8, 0.9, 1.0], 8)[:, None]
    force += np.random.default_rng(4).normal(0.0, 0.1, force.shape)
    found = gap_wall.held_by(gap_wall.Walled(led_mm, force, 0.075), 0.0)
    assert found is not None
    assert found[0] == pytest.approx(28.0, rel=0.03)


def test_a_loop_and_devices_that_come_late_are_told_apart(logs: list[Path]) -> None:
    ticks = dict(enumerate(record for record in read_log(logs[0]).records() if record.wrench is not None))
    ticks = {slot: ticks[slot] for slot in range(150, 260)}
    assert gap_late.comes_late(ticks) == ""
    kept = {slot: record for slot, record in ticks.items() if not 200 <= slot < 206}
    assert gap_late.comes_late(kept) == "loop"
    stuck = {
        slot: replace(record, wrench=ticks[200].wrench) if 200 < slot < 212 else record
        for slot, record in ticks.items()
    }
    assert gap_late.comes_late(stuck) == "devices"


def test_an_arm_whose_cell_is_held_up_falls_behind_the_simulated_one() -> None:
    simulated = np.cumsum(np.full((60, 6), 2e-4), axis=0)
    assert not gap_late.falls_behind(gap_cell.late(simulated, 1.5), simulated, 3e-5)
    held_up = simulated.copy()
    held_up[30:34] = simulated[29]
    assert gap_late.falls_behind(held_up, simulated, 3e-5)


def test_logs_of_another_cell_and_of_no_contact_are_refused(
    logs: list[Path], palpate: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    palpate.succeed("run", "--policy", "torque", "--trials", 1, "--cell.peg.clearance-mm", "0.1", "--out", "other")
    untouched = Path(__file__).parents[3] / "golden" / "no-contact.mcap"
    # Where others touched it is left out, as is a peg that drops straight into the hole.
    with pytest.raises(ConfigurationError, match=f"logs recorded with the cell and arm of {re.escape(str(logs[0]))}"):
        gap_of([untouched, logs[0], Path("other/logs/trial-00000.mcap")], lambda: None)
    with pytest.raises(ConfigurationError, match="but for its sensor, the cell of the other logs"):
        gaps_of(logs, [Path("other/logs/trial-00000.mcap")], lambda: None)
    with monkeypatch.context() as fits:
        fits.setattr(gap, "_fitted", None)
        for logs_and_reference in ((logs, [untouched]), (logs[:1], [logs[1], Path("other/logs/trial-00000.mcap")])):
            with pytest.raises((LogError, ConfigurationError), match=r"holds no contact|logs recorded with the cell"):
                gaps_of(*logs_and_reference, lambda: None)
    with pytest.raises(LogError, match="holds no contact"):
        gap_of([untouched], lambda: None)
    assert "palpate gap needs logs" in palpate.refusal("gap")


def test_what_cannot_come_out_is_refused_before_a_log_is_read(palpate: CommandLine) -> None:
    """A fit takes minutes."""
    untouched = Path(__file__).parents[3] / "golden" / "no-contact.mcap"
    assert "cannot be written (No such file" in palpate.refusal("gap", untouched, "--out", "nowhere/cell.toml")
    Path("cell.toml").touch()
    assert "never overwritten" in palpate.refusal("gap", untouched, "--out", "cell.toml")
    Path("same.mcap").symlink_to(untouched)
    told = palpate.refusal("gap", untouched, "--reference", "same.mcap")
    assert "other logs than those that are held against it" in told
