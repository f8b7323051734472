"""Policies, given by name or file: baselines, and learners with programmed and example states."""

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from palpate.adapters.config import RunConfig, entries, task_kind
from palpate.adapters.experiments.baselines import Oracle, OraclePose, Spiral, TorqueFollowing
from palpate.adapters.experiments.build import OPTIONS, task_actions, task_bounds
from palpate.adapters.experiments.documents import load_examples, load_policy
from palpate.adapters.experiments.third_party import GROUP, third_party_code, third_party_entry, third_party_policy
from palpate.adapters.log import made_with
from palpate.core.errors import ConfigurationError
from palpate.core.motion import FASTEST_TURN_RAD_S
from palpate.core.perception import Perception, perception_from_dict, perception_to_dict
from palpate.core.policy import (
    ExamplesPolicy,
    MixedPolicy,
    OptionParameters,
    Policy,
    PolicyDocument,
    ProgrammedPolicy,
    QParameters,
    RandomWalkPolicy,
    SarsaParameters,
    TemperatureSchedule,
    document_of,
    new_learner,
    policy_from,
)
from palpate.core.ports import CONTROL_RATE_HZ, Settings, fitted
from palpate.core.tasks.insertion_6dof import CornerFirst, SpatialOptions
from palpate.core.trial import N_PER_KGF, options_of

ORACLE_SPEED_M_S: Final = 0.01

_TURN_SHARE: Final = 0.75
"""Fraction of the maximum turning speed to use. At full speed, a wrist exceeded the lag limit in 1 of 100 cases."""

_NEVER: Final = -1e6
"""Q of an option that cannot start, so low that the option is never selected at any temperature."""

Hole = Callable[[], Sequence[float]]
"""Function that returns the values from :func:`pose_of`, or only the first three."""


def pose_of(hole_m: Sequence[float], turn_rad: Sequence[float], drawn: Mapping[str, float]) -> tuple[float, ...]:
    """Return the true hole (x, y, z), its rotation vector (3,) and, if drawn, the heading of the tilt in the grip."""
    heading = (drawn["tilt_heading_deg"],) if "tilt_heading_deg" in drawn else ()
    return *hole_m, *turn_rad, *heading


OUTSIDE: Final = "environment"
"""Source of decisions that an external agent makes in an environment."""

BASELINES: Final = ("oracle", "torque", "spiral-10", "spiral-5", "random", "corner-first", "oracle-pose")


def baselines_of(config: RunConfig) -> list[str]:
    """Return the baselines for the task."""
    found = []
    for name in BASELINES:
        with suppress(ConfigurationError):
            baseline(name, config, tuple)
            found.append(name)
    return found


NO_POLICY: Final = "none"
"""Placeholder name for tasks without policies."""


def policy_for(config: RunConfig, name: str) -> str:
    """Return the name of the policy; :data:`NO_POLICY` for a task without policies.

    Raises:
        ConfigurationError: A required policy is missing, or a policy is named for a task without policies.
    """
    task = config.task.name
    if task_kind(task).queries_policy:
        if name in ("", NO_POLICY):
            raise ConfigurationError("policy", name, accepted_policies())
        return name
    if name not in ("", NO_POLICY):
        raise ConfigurationError("policy", name, f"left out with --task {task}, which uses no policy")
    return NO_POLICY


def baseline(name: str, config: RunConfig, hole_m: Hole) -> Policy:
    """Return the named baseline, one of ``BASELINES``; only the oracles use the true hole.

    Raises:
        ConfigurationError: The name is unknown.
    """
    task, action_s = config.task, config.task.ticks_per_action / CONTROL_RATE_HZ
    # Use the task's own actions, because baselines have no options.
    actions = task_kind(task.name).actions(task)
    match name:
        case "none":
            return RandomWalkPolicy(task_actions(config))
        case "random":
            return RandomWalkPolicy(actions)
        case "torque":
            return TorqueFollowing(actions, config.perception.torque_threshold_kgf_mm * 1e-3 * N_PER_KGF)
        case "spiral-10" | "spiral-5":
            speed_m_s = 0.010 if name == "spiral-10" else 0.005
            # The distance between turns follows from clearance and chamfer.
            return Spiral(name, config.learning.belief.pitch_mm * 1e-3, speed_m_s * action_s)
        case "oracle":
            return Oracle(hole_m, ORACLE_SPEED_M_S * action_s)
        case "corner-first":
            return CornerFirst(spatial_options(config))
        case "oracle-pose":
            spatial_options(config, "oracle-pose")
            longest = task.travel_speed_mm_s * 1e-3 * action_s, _TURN_SHARE * FASTEST_TURN_RAD_S * action_s
            return OraclePose(hole_m, config.cell.tilt_mrad * 1e-3, config.cell.tilt_heading_deg, *longest)
    raise ConfigurationError("policy", name, accepted_policies())


def spatial_options(config: RunConfig, policy: str = "corner-first") -> SpatialOptions:
    """Return the options for an insertion in six degrees of freedom.

    Raises:
        ConfigurationError: The task is of a different kind.
    """
    if task_kind(config.task.name).options is not SpatialOptions:
        raise ConfigurationError("policy", policy, "a policy of this task; it is one of --task insertion-6dof")
    return options_of(SpatialOptions, config.task)


def learning_parameters(config: RunConfig) -> Settings:
    """Return the learner's parameters."""
    learning = config.learning
    if config.learner in ("belief", "hmm"):
        return learning.belief if config.learner == "belief" else learning.hmm
    floor, in_use = learning.temperature_floor, learning.temperature_in_use
    schedule = TemperatureSchedule(
        learning.temperature, learning.temperature_decay, floor, in_use if in_use < floor else None
    )
    common: dict[str, Any] = {
        name: getattr(learning, name) for name in ("alpha", "gamma", "alpha_visits", "alpha_floor", "initial_value")
    }
    if config.learner in ("sarsa", "options"):
        kind = SarsaParameters if config.learner == "sarsa" else OptionParameters
        return kind(**common, temperature=schedule, trace_decay=learning.trace_decay)
    return QParameters(**common, temperature=schedule)


def learning_policy(config: RunConfig, perception: Perception, code: str = "") -> Policy:
    """Return a new learner, from third-party ``code`` if given, combined with the programmed and example states."""
    if code:
        return third_party_policy(third_party_entry(code), config, perception, frozen=False)
    learning, actions = config.learning, task_actions(config)
    parts: list[Policy] = []
    try:
        if learning.programmed:
            parts.append(ProgrammedPolicy(perception.states, actions, learning.programmed))
        if learning.examples:
            pairs = load_examples(Path(learning.examples), perception.states, actions)
            parts.append(ExamplesPolicy(perception.states, actions, pairs))
    except ConfigurationError as error:
        # The setting has different names in the configuration and in the core.
        field = error.field.replace("policy.", "learning.", 1)
        raise ConfigurationError(field, error.value, error.accepted) from error
    learner = new_learner(learning_parameters(config), perception.states, actions, task_bounds(config))
    if config.learner == "belief" and not parts:
        # A belief has no state or action names.
        parts.append(ProgrammedPolicy(perception.states, actions, {}))
    if config.perception.symbols == OPTIONS:
        kind, begun = task_kind(config.task.name), learner.get_state()
        ahead, behind = learning.initial_value, learning.initial_value - learning.optimistic_prior
        begun["q"] = [
            [
                _NEVER if not kind.can_start(one.name, state) else ahead if kind.by_rule(one.name, state) else behind
                for one in actions
            ]
            for state in perception.states
        ]
        learner.set_state(begun)
    parts.append(learner)
    return parts[0] if len(parts) == 1 else MixedPolicy(perception.states, parts)


def perception_settings(config: RunConfig, perception: Perception) -> dict[str, Any]:
    """Return the perception settings, from raw signals to states, as stored in a policy file."""
    p = config.perception
    signal = {"cutoff_Hz": p.cutoff_Hz, "order": p.filter_order, "calibration": list(p.calibration)}
    if config.learner == "belief":
        signal["tool"] = tool_of(config)
    return {**perception_to_dict(perception), "signal": signal}


def accepted_policies() -> str:
    """Return the accepted policy names, for a message."""
    return f"a policy file, or one of {', '.join((*BASELINES, *sorted(entries(GROUP))))}, or package.module:Name"


def policy_named(name: str, accepted: str = "") -> tuple[PolicyDocument | None, str]:
    """Return the policy file or the third-party policy with this name; ``accepted`` lists the valid names in the error.

    Raises:
        ConfigurationError: There is no such file or policy, or the file cannot be read.
    """
    if os.path.isdir(name):
        raise ConfigurationError("policy", name, f"a policy file, such as {os.path.join(name, 'policy.json')}")
    if os.path.exists(name):
        return load_policy(Path(name)), ""
    if not (code := third_party_code(name)):
        wanted = accepted or accepted_policies()
        is_path = name.endswith(".json") or os.sep in name
        raise ConfigurationError("policy", name, f"no such file; accepted: {wanted}" if is_path else wanted)
    return None, code


def third_party_document(code: str, config: RunConfig, perception: Perception) -> PolicyDocument:
    """Return the policy file for a new third-party policy.

    Raises:
        ConfigurationError: The code cannot be loaded, or creates no policy.
    """
    policy = third_party_policy(third_party_entry(code), config, perception, frozen=True)
    return document_of(policy, created_with=made_with(), perception=perception_settings(config, perception))


def perception_of(document: PolicyDocument, config: RunConfig, configured: Perception | None) -> Perception:
    """Return the perception stored in a policy file, after comparing it with the run's.

    If ``configured`` is None, the run's perception would have to be fitted, so the one from the file is used instead.

    Raises:
        ConfigurationError: The two differ.
    """
    try:
        own = perception_from_dict({key: value for key, value in document.perception.items() if key != "signal"})
    except ConfigurationError as error:
        raise ConfigurationError("policy", "perception", f"a readable perception ({error})") from error
    if configured is not None:
        document.check_matches(configured.states, task_actions(config))
    # Fitted stages come from the file; stages defined by the configuration must be equal in both.
    mine, theirs = dict(document.perception), perception_settings(config, own if configured is None else configured)
    if configured is not None and not document.reads_states:
        # Its contact model gives torque per pressing force, so thresholds for other presses or force limits also fit.
        own, mine = configured, {**theirs, "signal": {}}
    # A different tool has its own error message.
    for each, signal in ((mine, _signal_in(document)), (theirs, theirs["signal"])):
        each["signal"] = {name: value for name, value in signal.items() if name != "tool"}
    if mine != theirs:
        where, mine, wanted = first_difference(mine, theirs)
        other = config.learner if document.learner is None else document.learner.kind
        remedy = "" if other == config.learner else f"--learner {other}, or "
        raise ConfigurationError(
            f"policy.perception.{where}",
            mine,
            f"{wanted!r}, as the run is configured (or use {remedy}--config with the run.toml next to the policy)",
        )
    return own


def loaded_policy(document: PolicyDocument, config: RunConfig, perception: Perception, *, frozen: bool) -> Policy:
    """Return the policy stored in a file, frozen or ready to continue learning with the configured parameters.

    Raises:
        ConfigurationError: The stored states, actions or learner differ, or the policy's code cannot be loaded.
        PolicyError: The policy's code rejects its learned state.
    """
    _require_same_tool(document, config)
    if document.third_party is not None:
        document.check_matches(perception.states, task_actions(config))
        return third_party_policy(document.third_party, config, perception, frozen=frozen)
    learner = document.learner
    if not frozen and learner is not None:
        config.require("learner", learner.kind == config.learner, f"{learner.kind!r}, as in the policy file")
        document = replace(document, learner=replace(learner, parameters=learning_parameters(config)))
    return policy_from(document, perception.states, task_actions(config), task_bounds(config), frozen=frozen)


def first_difference(a: Any, b: Any, where: str = "") -> tuple[str, Any, Any]:
    """Return the first setting that differs between two tables: its dotted name, and both values."""
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        for key in sorted(set(a) | set(b)):
            if a.get(key) != b.get(key):
                return first_difference(a.get(key), b.get(key), f"{where}.{key}" if where else str(key))
    return where, a, b


def _signal_in(document: PolicyDocument) -> Mapping[str, Any]:
    """Return the signal settings and the tool stored in a policy file."""
    found: Mapping[str, Any] = fitted(
        "policy.perception.signal", document.perception.get("signal", {}), Mapping[str, Any]
    )
    return found


def tool_of(config: RunConfig) -> dict[str, Any]:
    """Return the peg settings that determine its contact torques; the clearance is not one of them."""
    peg = config.cell.peg
    settings = {"cross_section": peg.cross_section, "diameter_mm": peg.diameter_mm, "chamfer_mm": peg.chamfer_mm}
    if peg.cross_section == "rounded-square":
        settings["corner_radius_mm"] = peg.corner_radius_mm
    if peg.cross_section == "keyed":
        settings["flat_mm"] = peg.flat_mm
    return {f"cell.peg.{name}": value for name, value in settings.items()}


def tool_in(document: PolicyDocument) -> dict[str, Any] | None:
    """Return the tool for a policy file's contact model, or None if it has no such model or comes from a log."""
    tool = _signal_in(document).get("tool")
    if tool is None or document.learner is None or document.learner.kind != "belief":
        return None
    return dict(fitted("policy.perception.signal.tool", tool, Mapping[str, Any]))


def _require_same_tool(document: PolicyDocument, config: RunConfig) -> None:
    """Reject a contact model for a different tool, unless it is requested as a starting point."""
    learned = tool_in(document)
    if learned is None or config.learning.belief.other_tool:
        return
    for name, value in tool_of(config).items():
        if learned.get(name) != value:
            remedy = "or --learning.belief.other-tool, to start from another tool's contact model"
            raise ConfigurationError(name, value, f"{learned.get(name)!r}, as in the policy's contact model ({remedy})")
