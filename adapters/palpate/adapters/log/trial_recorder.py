"""Recorder for a run's trials, with one log per trial. Each log contains the complete initial state."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Self

from palpate.adapters.config import RecordingConfig, RunConfig, to_toml, with_options
from palpate.adapters.log.json_text import dump_json
from palpate.adapters.log.provenance import arm_sha256, core_sha256, made_with, processor
from palpate.adapters.log.raised import raised_by
from palpate.adapters.log.recorder import FlightRecorder
from palpate.adapters.log.records import DecisionEntry, EndRecord, StartRecord, policy_digest
from palpate.adapters.log.schema import SCHEMA
from palpate.adapters.log.sink import FileSink, Sink
from palpate.core.control_loop import LoopObserver
from palpate.core.errors import OutputError
from palpate.core.perception import Perception, perception_to_dict
from palpate.core.policy import Policy, ThirdPartyPolicy, document_of, learner_of
from palpate.core.ports import WorldRecord
from palpate.core.trial import Purpose, ReadyPose, Task, TrialReport, TrialSetup, generator

_OF_REPORT: Final = ("exploration_time_s", "actions", "peak_force_N", "depth_m", "ticks", "clamped_ticks")
LOG_FOLDER: Final = "logs"
CUT_SHORT: Final = ".cut-short-"


class TrialRecorder:
    """Recorder that logs trials in a folder until the context exits. ``losses`` lists lost data with reasons."""

    def __init__(self, sink: Sink, folder: Path, config: RecordingConfig) -> None:
        self._sink, self._folder, self._stop = sink, folder, config.on_loss == "stop"
        self._subject: _Subject | None = None
        self._flight: FlightRecorder | None = None
        self._setup: TrialSetup | None = None
        self._before = ""
        self.losses = sink.losses

    @classmethod
    def into(cls, folder: Path, config: RecordingConfig) -> TrialRecorder | None:
        """Create a recorder that writes files according to the configuration, or return None if recording is off."""
        return cls(FileSink(), folder, config) if config.enabled else None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        # A log that is still open lacks only its end record.
        self._close(None)
        self._sink.shut()

    def of(
        self,
        command: str,
        config: RunConfig,
        ready: ReadyPose,
        task: Task,
        perception: Perception,
        policy: Policy,
        *,
        name: str = "",
        frozen: bool = True,
        subfolder: str = "",
        derived_from: str = "",
    ) -> None:
        """Set the policy for the following trials (``name`` for a baseline) and the log on which a what-if is based."""
        # The learned state is recorded for each trial, in the learner's state.
        document = None if name else document_of(policy, created_with={}, perception={}).unlearned()
        third_party = None if document is None else document.third_party
        constant = {
            **start_facts(command, with_options(config), ready, perception),
            "policy": name or "document" if third_party is None else third_party.code,
            "policy_json": "" if document is None else dump_json(json.loads(document.to_json_text())),
            "frozen": frozen,
            "derived_from": derived_from,
        }
        self._subject = _Subject(self._folder / subfolder, task, perception, policy, constant)

    def begin(
        self,
        setup: TrialSetup,
        world: WorldRecord,
        name: str,
        counterfactual: Callable[[], bool] = lambda: False,
    ) -> LoopObserver:
        """Open a trial's log and return its observer. A what-if is counterfactual once it leaves the recorded path."""
        subject = self._subject
        if subject is None:
            raise OutputError(str(self._folder), "the subject of the recording is not set", "call of() first")
        self._close(None)
        facts = {**subject.constant, "seed": setup.seed, "trial": setup.index}
        names = ("schema", "command", "arm", "policy", "seed", "trial")
        metadata = {**{name: str(facts[name]) for name in names}, "versions": facts["versions_json"]}
        self._sink.open(subject.folder / f"{name}.mcap", metadata)
        self._setup = setup

        def start() -> StartRecord:
            record = subject.start(setup, world)
            self._before = record.learner_json
            return record

        self._flight = FlightRecorder(self._sink, start, counterfactual, stop_on_loss=self._stop)
        return self._flight

    def end(self, report: TrialReport, facts: dict[str, Any]) -> None:
        """Close the log of a completed trial, adding data that the core lacks: ground truth and data about the rig."""
        self._close(end_of(report, **self._policy_fields(report), **facts))

    def fail(self, report: TrialReport, error: BaseException, facts: dict[str, Any] | None = None) -> None:
        """Close the log of a trial that ended with an error. The arguments are the same as for :meth:`end`."""
        if self._setup is not None and report.setup is not self._setup:
            # The task did not begin: the report is that of the previous trial.
            report = TrialReport(self._setup)
        by = raised_by(error, "" if self._flight is None else self._flight.failed_port)
        text = {"error": type(error).__name__, "text": str(error), "raised_by": by}
        self._close(end_of(report, **self._policy_fields(report), **text, **(facts or {})))

    def _close(self, record: EndRecord | None) -> None:
        flight, self._flight = self._flight, None
        if flight is not None:
            flight.end(record)
            self._sink.close()

    def _policy_fields(self, report: TrialReport) -> dict[str, Any]:
        subject = self._subject
        if subject is None:
            return {}
        learner = subject.learner_json()
        if not isinstance(subject.policy, ThirdPartyPolicy):
            return {"learner_json": learner}
        decisions = [DecisionEntry.of(n, one, report.temperature) for n, one in enumerate(report.decisions)]
        return {"learner_json": learner, "policy_sha256": policy_digest(decisions, self._before, learner)}


def start_facts(command: str, config: RunConfig, ready: ReadyPose, perception: Perception) -> dict[str, Any]:
    """Return the start record fields that follow from the configuration, ready pose, perception and computer."""
    return {
        "schema": SCHEMA,
        "command": command,
        "config_toml": to_toml(config),
        "arm": str(config.arm),
        "model_sha256": arm_sha256(config.arm, config.tool.geometry),
        "core_sha256": core_sha256(),
        "ready_rad": tuple(ready.q_rad.tolist()),
        "tip_rotation": tuple(ready.tip_rotation.ravel().tolist()),
        "perception_json": dump_json(perception_to_dict(perception)),
        "versions_json": dump_json(made_with()),
        "processor_json": dump_json(processor()),
    }


def trial_name(number: int) -> str:
    """Return the name of a trial's log, given the trial's number in the run."""
    return f"trial-{number:05d}"


def end_of(report: TrialReport, **others: Any) -> EndRecord:
    """Return the end record for a trial's report."""
    shared = {name: getattr(report, name) for name in _OF_REPORT}
    outcome = "" if report.outcome is None else report.outcome.value
    return EndRecord(tick=report.ticks - 1, outcome=outcome, **shared, **asdict(report.timing), **others)


def set_aside(folder: Path, first: int) -> list[Path]:
    """Rename the logs of trials that will be repeated, so that recordings of interrupted trials are kept."""
    moved = []
    for path in sorted(folder.glob("trial-*.mcap")):
        digits = path.stem.removeprefix("trial-")
        if digits.isdigit() and int(digits) >= first:
            attempt = 1
            while os.path.exists(f"{path}{CUT_SHORT}{attempt}"):
                attempt += 1
            moved.append(path.rename(f"{path}{CUT_SHORT}{attempt}"))
    return moved


@dataclass(frozen=True)
class _Subject:
    folder: Path
    task: Task
    perception: Perception
    policy: Policy
    constant: dict[str, Any]

    def start(self, setup: TrialSetup, world: WorldRecord) -> StartRecord:
        """Return the start record, after the task has begun."""
        state = generator(setup.seed, Purpose.POLICY, setup.index).bit_generator.state
        return StartRecord(
            seed=setup.seed,
            trial=setup.index,
            start_m=setup.start_m,
            learner_json=self.learner_json(),
            perception_state=tuple(self.perception.get_state()),
            filter_state=tuple(self.task.filter_state),
            generator_json=dump_json(state),
            temperature=self.task.report.temperature,
            world=world.kind,
            world_json=dump_json(world.facts),
            **self.constant,
        )

    def learner_json(self) -> str:
        learner = learner_of(self.policy)
        return "" if learner is None else dump_json(learner.get_state())
