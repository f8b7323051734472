"""Use a log's start record to reconstruct the objects that ran the trial."""

import json
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from typing_extensions import override

from palpate.adapters.config import RunConfig, nested, overlay
from palpate.adapters.experiments import (
    OUTSIDE,
    baseline,
    build_supervisor,
    build_task,
    loaded_policy,
    policy_for,
    pose_of,
    task_actions,
    third_party_policy,
)
from palpate.adapters.log import TrialLog, config_of, recorded_drawn, recorded_sensor, recorded_turn
from palpate.adapters.replay.tape import TapeEndError
from palpate.core.errors import ConfigurationError, LogError, PalpateError
from palpate.core.perception import Perception, perception_from_dict
from palpate.core.policy import (
    PERSON,
    Action,
    Decision,
    FixedPolicy,
    Observation,
    Policy,
    PolicyDocument,
    Spatial,
    ThirdPartyEntry,
    learner_of,
)
from palpate.core.ports import SensorFacts
from palpate.core.supervision import SupervisionConfig, Supervisor, weaker_settings
from palpate.core.trial import ReadyPose, Task, TrialSetup

_OUTSIDE: Final = ("cell", "recording")
"""Settings for the world and the recorder, which do not affect a replay."""


@dataclass(frozen=True)
class Rebuilt:
    """The core at the beginning of a trial, and the reason for using logged decisions (empty if the policy decides)."""

    config: RunConfig
    setup: TrialSetup
    ready: ReadyPose
    task: Task
    perception: Perception
    policy: Policy
    baseline: str
    frozen: bool
    supervisor: Supervisor
    recorded_decisions: str = ""


@dataclass(frozen=True)
class Changes:
    """Changes to a replay relative to its recording: settings as ``name=value``, and a different policy."""

    settings: tuple[str, ...] = ()
    policy: PolicyDocument | ThirdPartyEntry | str | None = None
    policy_name: str = ""

    @property
    def any(self) -> bool:
        """True if anything is changed."""
        return bool(self.settings) or self.policy is not None


def changed_config(log: TrialLog, changes: Changes) -> RunConfig:
    """Return the configuration for the replay.

    Raises:
        ConfigurationError: A change is rejected.
    """
    config = config_of(log)
    for setting in changes.settings:
        table = parse_setting(setting)
        limits = table.get(SupervisionConfig.TABLE)
        if isinstance(limits, dict):
            # A limit that is no longer weak need not be declared as weak.
            weak = weaker_settings({**vars(config.supervision), **limits})
            limits.setdefault("weakened", [name for name in config.supervision.weakened if name in weak])
        config = overlay(config, table)
    return config


def parse_setting(setting: str) -> dict[str, Any]:
    """Return the nested table for ``name.of.field=value``.

    Raises:
        ConfigurationError: The text is not of this form, or names a setting that does not affect a replay.
    """
    name, equals, text = setting.partition("=")
    parts = name.strip().split(".")
    if not equals or not all(parts):
        raise ConfigurationError("--set", setting, "name.of.field=value, as in task.max_force_N=20")
    if parts[0] in _OUTSIDE or parts in (["arm"], ["scenario"]):
        accepted = "a setting of the core; the recorded world stays what it was"
        raise ConfigurationError("--set", setting, accepted)
    try:
        value = tomllib.loads(f"value = {text.strip()}")["value"]
    except tomllib.TOMLDecodeError:
        # Text needs no quotes.
        value = text.strip()
    return nested({name.strip(): value})


class RecordedDecisions(FixedPolicy):
    """Policy that repeats recorded decisions. The first ``observed`` grounds for a decision are not the policy's."""

    def __init__(self, actions: Sequence[Action], problem: str, observed: int) -> None:
        super().__init__()
        self._actions, self.problem, self._observed = tuple(actions), problem, observed
        self.log: TrialLog | None = None

    @property
    @override
    def temperature(self) -> float | None:
        return None if self.log is None else self.log.start.temperature

    @override
    def choose(self, observation: Observation) -> Decision:
        # An option is chosen once, but each of its actions is recorded.
        if self.log is None or observation.action_number >= len(self.log.decisions):
            raise TapeEndError("policy")
        entry = self.log.decisions[observation.action_number]
        if entry.index is not None and 0 <= entry.index < len(self._actions):
            # Otherwise the log contradicts itself, which the comparison of decisions detects.
            return Decision(self._actions[entry.index], entry.index, entry.source, entry.grounds[self._observed :])
        if len(entry.displacement_m) != 2 or entry.index is not None:
            problem = "does not say where the action leads"
            raise LogError(self.log.path, f"decision {entry.number}", problem, "it was altered")
        x, y = entry.displacement_m
        spatial = Spatial.of(entry.controller, entry.spatial) if entry.controller else None
        return Decision(Action(entry.action, (x, y), spatial), None, entry.source, entry.grounds[self._observed :])


class Rebuilder:
    """Builder that reconstructs the core for a series of logs. ``around`` wraps the policy for the task."""

    def __init__(self, changes: Changes | None = None, around: Callable[[Policy], Policy] | None = None) -> None:
        self._changes, self._around = changes or Changes(), around
        self._key: object = None
        self._supervisor: Supervisor | None = None
        self._sensor: SensorFacts | None = None
        self._kept: tuple[RunConfig, ReadyPose, Perception, Policy, Task] | None = None

    @property
    def what_if(self) -> bool:
        """True if anything is changed."""
        return self._changes.any

    def rebuild(self, log: TrialLog) -> Rebuilt:
        """Return the core at the beginning of the trial recorded in this log.

        Raises:
            LogError: The log lacks required data.
            ConfigurationError: A change does not match the log.
        """
        try:
            return self._rebuilt(log)
        except (PalpateError, KeyError, TypeError, ValueError) as error:
            if isinstance(error, LogError) or (self.what_if and isinstance(error, ConfigurationError)):
                raise
            raise LogError(log.path, "/start", f"cannot be rebuilt ({error})", "it was altered") from error

    def _rebuilt(self, log: TrialLog) -> Rebuilt:
        start = log.start
        # A task that was interrupted is not reused, because its state has changed.
        interrupted = any(event.name == "interrupt" for event in log.events)
        other = self._changes.policy
        name = start.policy if other is None else other if isinstance(other, str) else "document"
        # An oracle knows the hole, and third-party code may keep a state from one trial to the next.
        key = (
            start.config_toml, start.perception_json, start.policy, start.policy_json, start.frozen, start.ready_rad,
            start.tip_rotation, start.world_json if name.startswith("oracle") or ":" in name else "", _requested(log),
        )  # fmt: skip
        if self._kept is None or key != self._key:
            self._kept, self._key, self._supervisor = self._build(log), key, None
        config, ready, perception, policy, task = self._kept
        sensor = recorded_sensor(start.world_json)
        if self._supervisor is None or sensor != self._sensor:
            self._supervisor, self._sensor = build_supervisor(config, ready, sensor), sensor
        if isinstance(policy, RecordedDecisions):
            policy.log = log
        supervisor = self._supervisor
        if supervisor.latch.cause:
            supervisor.latch.acknowledge("replay", "a recording moves nothing")
        if interrupted:
            self._kept = None
        learner = learner_of(policy)
        if learner is not None and start.learner_json and self._changes.policy is None:
            learner.set_state(dict(json.loads(start.learner_json)))
        x, y = start.start_m
        setup = TrialSetup(start.trial, self._seed(log, config), (x, y))
        baseline_name = "" if name == "document" or (other is None and start.policy_json) else name
        frozen = log.start.frozen or other is not None
        problem = policy.problem if isinstance(policy, RecordedDecisions) else ""
        return Rebuilt(config, setup, ready, task, perception, policy, baseline_name, frozen, supervisor, problem)

    def _seed(self, log: TrialLog, config: RunConfig) -> int:
        changed = any(setting.partition("=")[0].strip() == "seed" for setting in self._changes.settings)
        return config.seed if changed else log.start.seed

    def _build(self, log: TrialLog) -> tuple[RunConfig, ReadyPose, Perception, Policy, Task]:
        config = changed_config(log, self._changes)
        start = log.start
        ready = ReadyPose(np.array(start.ready_rad), np.array(start.tip_rotation).reshape(3, 3))
        perception = perception_from_dict(json.loads(start.perception_json))
        perception, policy = self._policy(log, config, perception)
        acting = policy if self._around is None else self._around(policy)
        return config, ready, perception, policy, build_task(config, ready, perception, acting)

    def _policy(self, log: TrialLog, config: RunConfig, perception: Perception) -> tuple[Perception, Policy]:
        other = self._changes.policy
        if other is not None:
            policy_for(config, self._changes.policy_name)
        if isinstance(other, PolicyDocument):
            own = perception_from_dict({key: value for key, value in other.perception.items() if key != "signal"})
            return own, loaded_policy(other, config, own, frozen=True)
        if isinstance(other, ThirdPartyEntry):
            return perception, third_party_policy(other, config, perception, frozen=True)
        if other is None and log.start.policy == OUTSIDE:
            return perception, self._as_recorded(log, config, perception, "an external agent chose the actions")
        if other is not None or (log.start.policy != "document" and ":" not in log.start.policy):
            return perception, baseline(other or log.start.policy, config, lambda: _hole(log))
        document = PolicyDocument.from_json_text(log.start.policy_json)
        if document.third_party is not None:
            return perception, self._third_party(log, config, perception, document, document.third_party)
        return perception, loaded_policy(document, config, perception, frozen=log.start.frozen)

    def _third_party(
        self, log: TrialLog, config: RunConfig, perception: Perception, document: PolicyDocument, entry: ThirdPartyEntry
    ) -> Policy:
        """Return the third-party policy, or its recorded decisions if its code is missing."""
        document.check_matches(perception.states, task_actions(config))
        if entry.code != log.start.policy:
            raise ValueError(f"it names two policies, {log.start.policy} and {entry.code}")
        if _requested(log):
            return self._as_recorded(log, config, perception, "a person chose the actions")
        try:
            return third_party_policy(entry, config, perception, frozen=log.start.frozen)
        except ConfigurationError as error:
            return self._as_recorded(log, config, perception, str(error))

    def _as_recorded(self, log: TrialLog, config: RunConfig, perception: Perception, problem: str) -> Policy:
        """Return a policy that repeats the recorded decisions."""
        if self.what_if:
            text = f"the policy's code is missing, and the log cannot answer a what-if ({problem})"
            raise LogError(log.path, "", text, "install what made it, or name another --policy")
        return RecordedDecisions(task_actions(config), problem, 6 + len(perception.extractor.names))


def _requested(log: TrialLog) -> bool:
    """Return True if a person chose the actions."""
    return any(decision.source == PERSON for decision in log.decisions)


def _hole(log: TrialLog) -> Sequence[float]:
    hole = json.loads(log.start.world_json or "{}").get("hole_in_task_m")
    if not isinstance(hole, list) or len(hole) != 3:
        raise LogError(log.path, "/start", "does not say where the hole was", "only the oracle policy needs that")
    return pose_of(hole, recorded_turn(log.start.world_json), recorded_drawn(log.start.world_json))
