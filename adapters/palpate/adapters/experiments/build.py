"""Composition root, which builds cooperating objects from a configuration."""

import re
from collections.abc import Sequence
from dataclasses import replace
from math import sqrt
from pathlib import Path
from typing import Final

from palpate.adapters.config import (
    PerceptionConfig,
    RigFile,
    RunConfig,
    depth_step_mm,
    job_of,
    of_trial,
    require_corners,
    simulated_noise,
    task_kind,
)
from palpate.adapters.experiments.documents import load_automaton
from palpate.adapters.hardware import FaultFile, HardwareRig, find_approach
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.automata import AutomatonState
from palpate.core.errors import ConfigurationError
from palpate.core.job import NOISE_BAND, require_measurable
from palpate.core.motion import Kinematics, TipMotion, arm_named
from palpate.core.perception import (
    FACTS,
    GatedThresholds,
    IdentityState,
    LastAction,
    LastSymbols,
    Perception,
    SelectedChannels,
    SignalProcessor,
    Situations,
    StateIdentifier,
    Symboliser,
    TaskFacts,
    Thresholds,
)
from palpate.core.policy import (
    Action,
    ActionPenalty,
    InternalEffort,
    Policy,
    RandomWalkPolicy,
    Reinforcement,
    TaskBounds,
    TimePenalty,
)
from palpate.core.ports import CONTROL_RATE_HZ, PERIOD_S, FaultLatch, Rig, SensorFacts
from palpate.core.supervision import Supervisor, require_fitting
from palpate.core.trial import N_PER_KGF, Measurement, ReadyPose, Task, TaskParts, goal_in_base

NONE: Final = "none"
_EDGE_MM: Final = 0.2
"""Edge break on a hole without a chamfer; ISO 13715 allows 0.05 mm to 0.3 mm."""
OPTIONS: Final = "options"
_LAST_ACTION: Final = "last-action"
_FIELD: Final = "perception.memory"
_ACCEPTED: Final = "none, last-action, last-2, last-3 and so on, or an automaton file ending in .json"


def identifier(memory: str, symbols: tuple[str, ...], actions: Sequence[Action] = ()) -> StateIdentifier:
    """Return the named state identification for these symbols.

    Args:
        memory: ``none``: the state is the last symbol; ``last-N``: the last N symbols in order; or the path of an
            automaton file: the state is that of the automaton; ``last-action``: the last symbol and action.
        actions: Available actions.
    """
    if memory == NONE:
        return IdentityState(symbols)
    try:
        if memory == _LAST_ACTION:
            return LastAction(symbols, tuple(dict.fromkeys(action.name.partition(" ")[0] for action in actions)))
        if memory.endswith(".json"):
            return AutomatonState.of(load_automaton(memory), symbols=symbols)
        if last := re.fullmatch(r"last-([1-9][0-9]?)", memory):
            return LastSymbols(symbols, int(last[1]))
    except ConfigurationError as error:
        raise ConfigurationError(_FIELD, memory, error.accepted) from error
    raise ConfigurationError(_FIELD, memory, _ACCEPTED)


def task_actions(config: RunConfig) -> tuple[Action, ...]:
    """Return the actions from which policies choose.

    Raises:
        ConfigurationError: Options are requested, but the task has none.
    """
    kind = task_kind(config.task.name)
    if config.perception.symbols != OPTIONS:
        return kind.actions(config.task)
    if not (learner_options := kind.learner_options(config.task)):
        accepted = f"other symbols: the task {config.task.name} has no options"
        raise ConfigurationError("perception.symbols", OPTIONS, accepted)
    return learner_options


def plain_perception(config: RunConfig) -> Perception:
    """Return the default perception, for policies without states."""
    return build_perception(replace(config, perception=PerceptionConfig()))


def task_bounds(config: RunConfig) -> TaskBounds:
    """Return the region that a belief must cover: the exploration area around every possible centre."""
    task = config.task
    half_mm = task.area_half_width_mm + (task.start_uncertainty_mm if task.area_centre == "start" else 0.0)
    return TaskBounds(half_mm * 1e-3, task.ticks_per_action / CONTROL_RATE_HZ, task.longest_step_m)


def needs_fitting(config: RunConfig) -> bool:
    """Return True if the perception must be fitted to samples."""
    return config.perception.features != "channels" or config.perception.symbols in ("random", "clusters")


def build_perception(config: RunConfig) -> Perception:
    """Return a perception based on task knowledge alone; the module ``fitting`` fits other stages."""
    p = config.perception
    position, torque = p.position_threshold_mm * 1e-3, p.torque_threshold_kgf_mm * 1e-3 * N_PER_KGF
    names = p.channels
    symboliser: Symboliser
    if p.symbols == OPTIONS:
        symboliser = Situations()
        return Perception(TaskFacts(FACTS), symboliser, identifier(p.memory, symboliser.symbols, task_actions(config)))
    if p.symbols == "regions":
        symboliser = GatedThresholds(
            Thresholds(names[:2], ((-position, position),) * 2),
            Thresholds(names[2:], ((-torque, torque),) * 2),
        )
    else:
        symboliser = Thresholds(names, ((-position, position),) * 2 + ((-torque, torque),) * 2)
    return Perception(
        SelectedChannels(names), symboliser, identifier(p.memory, symboliser.symbols, task_actions(config))
    )


def build_reinforcement(config: RunConfig) -> Reinforcement:
    """Return the reinforcement for actions."""
    if config.learning.reinforcement == "effort":
        return InternalEffort(per_N_s=config.learning.effort_per_N_s, free_force_N=config.task.press_kgf * N_PER_KGF)
    if config.learning.reinforcement == "time":
        return TimePenalty()
    return ActionPenalty()


def ready_pose(config: RunConfig) -> ReadyPose:
    """Return the pose from which trials start.

    Raises:
        ConfigurationError: The task or arm is unknown, or the task settings are inconsistent.
        UnreachableError: The arm cannot perform the task at that place.
    """
    return task_kind(config.task.name).ready(config.arm, config.tool.geometry, config.task)


def clearances_mm(config: RunConfig) -> tuple[float, float]:
    """Return the peg's play in the hole, and the additional play at its mouth; by default, from the drawing."""
    peg, task = config.cell.peg, config.task
    play_mm = task.play_mm or peg.play_mm(config.cell.worn_clearance_mm)
    return play_mm, task.chamfer_mm or max(peg.chamfer_mm, _EDGE_MM)


def build_task(config: RunConfig, ready: ReadyPose, perception: Perception, policy: Policy) -> Task:
    """Return the core's task, ready to run on any ports."""
    arm, goal = arm_named(config.arm), goal_in_base(config.task.goal)
    signal = SignalProcessor(
        CONTROL_RATE_HZ,
        config.perception.cutoff_Hz,
        config.perception.filter_order,
        config.perception.calibration,
    )
    control = config.control
    axial_N_per_m = control.axial_stiffness_N_per_mm * 1e3
    kinematics = Kinematics(arm, config.tool.geometry)
    measurement = Measurement(kinematics, goal, signal, axial_N_per_m, control.damping_s(axial_N_per_m))
    motion = TipMotion(Kinematics(arm, config.tool.geometry), goal, ready.tip_rotation, PERIOD_S)
    play_mm, chamfer_mm = clearances_mm(config)
    task = replace(config.task, play_mm=play_mm, chamfer_mm=chamfer_mm)
    earned = build_reinforcement(config)
    parts = TaskParts(task, control, measurement, motion, perception, policy, earned)
    return task_kind(config.task.name).make(parts)


def build_supervisor(
    config: RunConfig, ready: ReadyPose, sensor: SensorFacts, latch: FaultLatch | None = None
) -> Supervisor:
    """Return the supervisor between the task and the arm; by default, with a new latch that is not set."""
    kinematics = Kinematics(arm_named(config.arm), config.tool.geometry)
    ready_rad = tuple(ready.q_rad.tolist())
    workspace, scale = task_kind(config.task.name).workspace(config.task), config.perception.calibration
    axial_N_per_m = config.control.axial_stiffness_N_per_mm * 1e3
    return Supervisor(
        config.supervision, config.task, workspace, kinematics, sensor, scale, axial_N_per_m, latch, ready_rad
    )


def supervisor_of(rig: Rig, config: RunConfig, ready: ReadyPose) -> Supervisor:
    """Return the supervisor for an open rig, with the rig's sensor properties, its latch, and suitable limits.

    Raises:
        FaultLatchedError: A trip or fault on this rig has not been acknowledged.
        ConfigurationError: A limit does not suit the rig.
    """
    rig.latch.require_free()
    require_limits(config, ready, rig.sensor_facts)
    return build_supervisor(config, ready, rig.sensor_facts, rig.latch)


def require_usable(config: RunConfig, ready: ReadyPose, rig_file: str = "") -> None:
    """Build a task once before any folder is created, because some settings are rejected only by building it.

    A rig's sensor must be read before :func:`require_limits` can be called.

    Raises:
        ConfigurationError: A setting is rejected.
    """
    task = config.task
    plate_mm = task.surface_uncertainty_mm + task.depth_tolerance_mm
    accepted = f"more than {plate_mm:g}, as deep as the plate itself may be taken to lie"
    task.require("insertion_depth_mm", task.insertion_depth_mm > plate_mm, accepted)
    off_mm = config.place.position_uncertainty_mm
    accepted = f"at least place.position_uncertainty_mm = {off_mm:g}, or holes lie outside"
    task.require("area_half_width_mm", task.area_half_width_mm >= off_mm, accepted)
    edge_mm = config.place.height_uncertainty_mm + 0.5e-3 * config.part.peg_mm * config.place.tilt_uncertainty_mrad
    accepted = f"more than {edge_mm:.3g}, or a tilted peg may begin in a plate that is higher than stated"
    task.require("ready_height_mm", task.ready_height_mm > edge_mm, accepted)
    for number in range(1, len(config.place.centres_mm)):
        other = of_trial(config, number, drawn=False)
        find_approach(other, ready_pose(other))
    walk = RandomWalkPolicy(task_actions(config))
    build_task(config, ready, plain_perception(config), walk)
    if not rig_file:
        require_corners(config)
        require_limits(config, ready, simulated_noise(config))


def require_limits(config: RunConfig, ready: ReadyPose, sensor: SensorFacts) -> None:
    """Check the limits for the task and the supervisor against the arm and the force sensor.

    Raises:
        ConfigurationError: The sensor's noise exceeds the task's signals, a limit can never trip or would always
            trip, or the sensor's frame is not the task's.
    """
    _require_quiet(config, sensor)
    step_mm, press_N = depth_step_mm(config), config.task.press_kgf * N_PER_KGF
    tolerance_mm = config.task.depth_tolerance_mm
    require_measurable(job_of(config), sensor, step_mm=step_mm, tolerance_mm=tolerance_mm, press_N=press_N)
    kinematics = Kinematics(arm_named(config.arm), config.tool.geometry)
    require_fitting(config.supervision, config.task, kinematics, ready.q_rad, sensor)


def _require_quiet(config: RunConfig, sensor: SensorFacts) -> None:
    """Check the noise in the unfiltered force, and in the torque after the low-pass filter, which reduces it."""
    band = config.perception.cutoff_Hz / (CONTROL_RATE_HZ / 2.0)
    passed = sqrt(NOISE_BAND * band)
    contact_N = config.task.contact_kgf * N_PER_KGF
    torque_Nm = config.perception.torque_threshold_kgf_mm * 1e-3 * N_PER_KGF
    if sensor.noise_N < contact_N and passed * sensor.noise_Nm < torque_Nm:
        return
    noise = f"noise of {sensor.noise_N:g} N and {1e3 * sensor.noise_Nm:g} mN m"
    accepted = (
        f"less than {contact_N:.2f} N, a contact, and {1e3 * torque_Nm / passed:.0f} mN m, of which the low-pass leaves"
        f" {1e3 * torque_Nm:.1f} mN m, a torque that points to the hole: insert with a finer sensor;"
        " one in an arm's flange serves as an additional coarse limit ([arm] force_stop_N)"
    )
    raise ConfigurationError("force_sensor.facts", noise, accepted)


def open_rig(
    config: RunConfig, ready: ReadyPose, rig_file: str = "", acknowledge: str = "", *, accept_kinematics: bool = False
) -> Rig:
    """Return the rig for trials, not yet entered: the simulator, or the devices in a rig file.

    Args:
        acknowledge: A person's acknowledgement of the rig's open fault, in the form ``NUMBER NAME: why``.

    Raises:
        ConfigurationError: The rig file or a setting in it cannot be used, or there is no fault to acknowledge.
        FaultLatchedError: A rig fault has not been acknowledged.
    """
    if not rig_file:
        if acknowledge:
            raise ConfigurationError("acknowledge", acknowledge, "left out without --rig: a simulator keeps no fault")
        return SimulatedRig(config, ready)
    file, latch = RigFile.load(Path(rig_file)), FaultFile(Path(rig_file), acknowledge)
    accepted = replace(file, accept_kinematics=accept_kinematics)
    return HardwareRig(accepted, config, find_approach(config, ready), latch)
