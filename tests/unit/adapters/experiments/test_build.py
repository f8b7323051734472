"""A configuration becomes objects that do what it says, or is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

from palpate.adapters.config import RunConfig, overlay, scenario
from palpate.adapters.experiments import true_hole_m
from palpate.adapters.experiments.build import build_perception, build_task, clearances_mm, identifier, supervisor_of
from palpate.adapters.experiments.policies import baseline
from palpate.adapters.experiments.trial import run_scored_trial
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.automata.document import to_json_text
from palpate.core.automata.machine import Kind, Machine
from palpate.core.errors import ConfigurationError, UnreachableError
from palpate.core.motion import Kinematics, arm_named
from palpate.core.perception import IdentityState, LastSymbols, stage_from_dict, stage_to_dict
from palpate.core.ports import CommandReason, JointCommand, Life
from palpate.core.trial import GoalConfig, TaskConfig, find_ready_pose, goal_in_base
from palpate.simulation.work_cell import SensorConfig
from tests.support.tool import TOOL
from tests.unit.adapters.samples import QUICK, ready_pose


@pytest.mark.parametrize("arm", ["zebra-zero", "ur5"])
def test_the_ready_pose_is_above_the_hole_and_points_into_it(arm):
    config = RunConfig(arm=arm)
    ready = find_ready_pose(config.arm, config.tool.geometry, config.task)
    kinematics = Kinematics(arm_named(arm), TOOL)
    kinematics.update(ready.q_rad)
    goal = goal_in_base(config.task.goal)
    assert goal.actInv(kinematics.tip_position_m) == pytest.approx(np.array([0.0, 0.0, -3e-3]), abs=1e-6)
    assert kinematics.tip_rotation[:, 2] == pytest.approx(goal.rotation[:, 2], abs=1e-6)


def test_a_hole_whose_surroundings_are_out_of_reach_is_refused():
    # The furthest goal that is reachable itself; the corners of a large area round it are not.
    def reachable(x_mm, half_width_mm):
        task = TaskConfig(goal=GoalConfig(x_mm=x_mm), area_half_width_mm=half_width_mm, start_uncertainty_mm=0.0)
        try:
            find_ready_pose("zebra-zero", TOOL, task)
        except UnreachableError:
            return False
        return True

    inside, outside = 400.0, 900.0
    while outside - inside > 20.0:
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if reachable(middle, 0.1) else (inside, middle)
    assert not reachable(inside, 40.0)


def test_a_rig_is_freed_from_its_last_stop_and_ends_closed():
    with SimulatedRig(QUICK, ready_pose()) as rig:
        home = JointCommand(rig.cell.joint_angles())
        rig.ports.arm.stop()
        assert rig.ports.arm.send(home).reason is CommandReason.STOPPED
        rig.prepare(0)
        assert rig.ports.arm.send(home).reason is CommandReason.AS_REQUESTED
    for device in (rig.ports.arm, rig.ports.force_sensor, rig.ports.joint_encoder):
        assert device.life is Life.CLOSED


class Narrow(SimulatedRig):
    """A cell whose sensor is said to end early."""

    @property
    def sensor_facts(self):
        return replace(super().sensor_facts, range_N=(115.0, 111.0, 28.0))


def test_limits_are_held_against_the_facts_of_the_rig_whatever_the_cell_is_set_to():
    silent = replace(QUICK, cell=replace(QUICK.cell, sensor=SensorConfig(force_noise_N=0.0, torque_noise_Nm=0.0)))
    with Narrow(silent, ready_pose()) as rig:
        with pytest.raises(ConfigurationError, match=r"max_force_N must be below 28, the sensor"):
            supervisor_of(rig, QUICK, ready_pose())
        fits = replace(QUICK, supervision=replace(QUICK.supervision, max_force_N=25.0))
        assert supervisor_of(rig, fits, ready_pose()).trip is None


@pytest.mark.parametrize(
    ("peg", "wear_mm", "stated", "expected_mm"),
    [
        ({}, 0.0, {}, (0.15, 0.2)),
        ({"clearance_mm": 0.5, "cross_section": "square"}, 0.0, {}, (1.4142, 0.2)),
        ({"clearance_mm": 0.5, "cross_section": "triangle"}, 0.0, {}, (1.7321, 0.2)),
        ({"clearance_mm": 0.5, "cross_section": "keyed"}, 0.0, {}, (1.0, 0.2)),
        ({"clearance_mm": 0.5, "chamfer_mm": 0.5}, 0.0, {}, (1.0, 0.5)),
        ({"clearance_mm": 0.5}, 0.25, {}, (1.5, 0.2)),
        ({"chamfer_mm": 2.0}, 0.0, {"play_mm": 0.6, "chamfer_mm": 1.0}, (0.6, 1.0)),
    ],
)
def test_walls_are_looked_for_as_far_as_the_shapes_of_peg_and_hole_leave_play(peg, wear_mm, stated, expected_mm):
    cell = {"peg": peg, "conditions": {"wear_mm": wear_mm}}
    config = overlay(RunConfig(), {"task": stated, "cell": cell})
    assert clearances_mm(config) == pytest.approx(expected_mm, abs=1e-4)


def test_a_peg_that_its_chamfer_let_in_far_aside_is_found_in_the_hole():
    # Eleven of fifteen such trials ended: no wall was looked for so far from where the peg sank in.
    config = overlay(scenario("paper"), {"seed": 5, "cell": {"peg": {"chamfer_mm": 0.9, "hole_depth_mm": 14.0}}})
    with SimulatedRig(config, ready_pose()) as rig:
        policy = baseline("oracle", config, lambda: true_hole_m(rig))
        task = build_task(config, ready_pose(), build_perception(config), policy)
        assert run_scored_trial(config, rig, task, 0).success


SYMBOLS = ("A", "B", "C")


def test_names_of_memories():
    assert identifier("none", SYMBOLS) == IdentityState(SYMBOLS)
    assert identifier("last-2", SYMBOLS) == LastSymbols(SYMBOLS, 2)
    assert len(identifier("last-3", SYMBOLS).states) == 3 + 9 + 27


def test_an_automaton_s_states_survive_their_way_into_a_policy_file(tmp_path):
    path = tmp_path / "automaton.json"
    path.write_text(
        to_json_text(Machine(Kind.MOORE, ("C", "A", "B"), ((None, 1, 0), (None, 0, None)), ("even", "odd")))
    )
    states = identifier(str(path), SYMBOLS)
    assert states.states == ("s0", "s1", "lost")
    again = stage_from_dict(json.loads(json.dumps(stage_to_dict(states))))
    assert again == states
    for symbol, state in ((0, 1), (1, 2), (0, 1), (2, 2), (1, 2)):
        assert states.update(symbol) == again.update(symbol) == state, symbol


@pytest.mark.parametrize(
    ("memory", "accepted"),
    [("last", "last-2"), ("last-0", "last-2"), ("", "none"), ("last-60", "states"), ("gone.json", "no such file")],
)
def test_memories_that_cannot_be_had_are_refused_by_their_setting(memory, accepted):
    with pytest.raises(ConfigurationError, match=r"perception\.memory") as message:
        identifier(memory, SYMBOLS)
    assert accepted in message.value.accepted
