"""A run, with its configuration, rig, policy, supervisor and recorder."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, Final, Self, TypeAlias

from palpate.adapters.config import RigFile, RunConfig, configured
from palpate.adapters.experiments import training
from palpate.adapters.experiments.build import open_rig, ready_pose, require_limits, require_usable
from palpate.adapters.experiments.evaluation import (
    FIRST_EVALUATION_TRIAL,
    ORACLE_ON_RIG,
    ChosenPolicy,
    warm_up,
    write_evaluation,
)
from palpate.adapters.experiments.fitting import fitted_perception
from palpate.adapters.experiments.planning import run_blocks
from palpate.adapters.experiments.results import RunFolder, RunResult, TrialRow, folder_named
from palpate.adapters.experiments.statistics import Claim, run_summary
from palpate.adapters.experiments.trial import ScoredTrial
from palpate.adapters.experiments.trials import NOT_RECORDED, Recording, Trials, TrialsObserver
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.core.errors import ConfigurationError, LifecycleError, PalpateError
from palpate.core.policy import Policy
from palpate.core.ports import Rig
from palpate.core.supervision import limits_line, weakened_lines
from palpate.core.trial import ReadyPose
from palpate.simulation.work_cell import inertia_lines, validity_lines

_MOST_LOSSES: Final = 5
Named: TypeAlias = str | os.PathLike[str]
"""A policy, given by name or file."""
MakeRig: TypeAlias = Callable[[RunConfig, ReadyPose], Rig]


def ignore(_: object) -> None:
    """Do nothing."""


class Run:
    """A run with its configuration, rig and policy, which trains, evaluates or performs single trials.

    The rig is opened at its first use. It is closed at the end of a ``with`` block around the run, or of the call that
    opened it.

    Args:
        job: Job file, its tables, or a complete configuration; None uses the rig's job, or else the paper's.
        rig: Rig file; if empty, the simulator is used.
        policy: Policy for :meth:`evaluate`: a baseline, a policy file, ``package.module:Name``, or an object.
        acknowledge: A person's acknowledgement of the rig's open fault, in the form ``NUMBER NAME: why``.
        accept_kinematics: Whether the operator accepts motion with the arm's nominal model.
        live: Live view of the trials.
        notify: Function that receives messages for the user; by default they are printed to standard error on a rig
            and discarded in the simulator.
        make_rig: Function that creates the rig in place of :func:`open_rig`, without entering it.
        presets: ``scenario``, ``learner``, ``task``, ``arm`` and ``settings``, as for :func:`configured`.

    Attributes:
        config: The configuration.
        ready: Pose from which trials start.

    Raises:
        ConfigurationError: A setting is unknown or rejected.
    """

    def __init__(
        self,
        job: RunConfig | Named | Mapping[str, Any] | None = None,
        *,
        rig: str = "",
        policy: Named | Policy = "",
        acknowledge: str = "",
        accept_kinematics: bool = False,
        live: TrialsObserver | None = None,
        notify: Callable[[str], object] | None = None,
        make_rig: MakeRig | None = None,
        **presets: Any,
    ) -> None:
        if isinstance(job, RunConfig):
            self.config = job
        else:
            file = policy if isinstance(policy, (str, os.PathLike)) else ""
            self.config = configured(job, rig=rig, policy=os.fspath(file), **presets)
        self.rig_file, self.policy, self.live = rig, policy, live
        self.ready = ready_pose(self.config)
        self.notify: Callable[[str], object] = notify or (note if rig else ignore)
        self._make_rig = make_rig or (
            lambda config, ready: open_rig(config, ready, rig, acknowledge, accept_kinematics=accept_kinematics)
        )
        self._rig: Rig | None = None
        self._opened, self._depth = ExitStack(), 0

    def __enter__(self) -> Self:
        self._depth += 1
        return self

    def __exit__(self, *error: Any) -> None:
        self._depth -= 1
        if self._depth == 0:
            self._rig = None
            self._opened.__exit__(*error)

    @property
    def rig(self) -> Rig:
        """The open rig.

        Raises:
            LifecycleError: The run is not in a ``with`` block.
            DeviceError: A device in the rig cannot be opened.
        """
        if self._depth == 0:
            raise LifecycleError("run", "not entered", "rig", "use it in a with block: with Run(...) as run")
        if self._rig is None:
            closed = self._make_rig(self.config, self.ready)
            if self.rig_file:
                warm_up(self.config, self.ready)
            self._rig = self._opened.enter_context(closed)
            require_limits(self.config, self.ready, self._rig.sensor_facts)
        return self._rig

    def chosen(self, policy: Named | Policy = "") -> ChosenPolicy:
        """Check a policy, by default the run's own, before any rig is opened.

        Raises:
            ConfigurationError: The policy is unknown or does not match the configuration, or a setting for the trials
                is rejected.
        """
        chosen = ChosenPolicy(policy or self.policy, self.config)
        if chosen.name.startswith("oracle") and self.rig_file:
            raise ConfigurationError("policy", chosen.name, ORACLE_ON_RIG)
        require_usable(self.config, self.ready, self.rig_file)
        return chosen

    def trials(self, chosen: ChosenPolicy, recording: Recording = NOT_RECORDED, **recorded: str) -> Trials:
        """Return trials with a policy on the rig, without training; for ``recorded``, see :class:`Trials`."""
        return Trials(
            self.config, self.ready, self.rig, chosen.perception, chosen.on(self.rig), recording,
            name=chosen.baseline, first=FIRST_EVALUATION_TRIAL, **recorded,
        )  # fmt: skip

    def trial(self, policy: Named | Policy = "", number: int = 0) -> ScoredTrial:
        """Run one trial without recording it.

        Args:
            number: Number of the trial. Together with the seed, it determines the random streams.
        """
        chosen = self.chosen(policy)
        with self:
            return self.trials(chosen).run(FIRST_EVALUATION_TRIAL + number)

    def evaluate(
        self,
        trials: int = 50,
        policy: Named | Policy = "",
        out: Named = "",
        *,
        jobs: int = 1,
        claim: Claim | None = None,
        on_trial: Callable[[int], object] = ignore,
    ) -> RunResult:
        """Run a policy that does not learn; Ctrl-C ends it early.

        Args:
            policy: Policy to use instead of the run's own.
            out: Folder for logs, tables and summary. Without one, simulated trials are not recorded, and trials on a
                rig are recorded in the next free folder below ``runs``.
            jobs: Number of processes in the simulator. With several, a new policy object is used every 10 trials.
            claim: Claim that the trials prove or refute.
            on_trial: Function that receives the number of trials finished since the previous call.

        Raises:
            ConfigurationError: A setting or the policy is rejected.
            OutputError: The folder already holds a run.
            DeviceError: A device failed, or the supervisor tripped on a rig.
        """
        chosen = self.chosen(policy)
        if jobs > 1 and (self.rig_file or self.live is not None or chosen.is_object):
            raise ConfigurationError("jobs", jobs, "1 on a rig, with a live view or with a policy object")
        folder = folder_named(out, f"{self.config.scenario}-run") if out or self.rig_file else None
        if folder is not None:
            folder.require_free()
        facts, recording = {"trials": trials, "policy": chosen.name}, NOT_RECORDED
        with ExitStack() as kept:
            if jobs > 1:
                self.begin(kept, folder, "run", **facts)
                rows, losses = run_blocks(self.config, chosen.name, trials, jobs, folder, on_trial)
                self._notify_losses(losses)
            else:
                with self.opened(), ExitStack() as opened:
                    self.begin(kept, folder, "run", **facts)
                    recording = self.record(kept, opened, folder)
                    rows = self.rows(chosen, trials, recording, folder, on_trial=on_trial)
                losses = recording.losses
            if folder is None:
                summary = run_summary(self.config, rows, trials, policy=chosen.name)
            else:
                summary = write_evaluation(self.config, folder, chosen.name, chosen.document, rows, trials, claim)
        return RunResult(rows, summary, len(rows) == trials, folder, losses, recording.timing)

    def rows(
        self,
        chosen: ChosenPolicy,
        trials: int,
        recording: Recording = NOT_RECORDED,
        folder: RunFolder | None = None,
        *,
        on_trial: Callable[[int], object] = ignore,
        **recorded: str,
    ) -> list[TrialRow]:
        """Run trials with a policy object on the open rig until all are finished or Ctrl-C ends them.

        Args:
            folder: Folder whose ``trials.csv`` gets one line per trial.
            recorded: ``command`` and ``subfolder``, as for :class:`Trials`.
        """
        rows: list[TrialRow] = []

        def done(scored: ScoredTrial) -> None:
            keep = TrialRow.of if folder is None else folder.append_trial
            rows.append(keep(scored, FIRST_EVALUATION_TRIAL))
            on_trial(1)

        first = FIRST_EVALUATION_TRIAL
        self.trials(chosen, recording, **recorded).run_all(range(first, first + trials), done)
        return rows

    def train(
        self,
        trials: int,
        out: Named,
        policy: str = "",
        *,
        resume: bool = False,
        on_begin: Callable[[RunFolder, int], object] = lambda folder, first: None,
        on_trial: Callable[[ScoredTrial], object] = ignore,
    ) -> RunResult:
        """Train until ``trials`` trials are finished, or until Ctrl-C. :meth:`evaluate` then runs the learned policy.

        Args:
            out: Folder for the policy, its logs, tables and learning curve.
            policy: Policy file, or code, to train instead of a new learner with the configured settings.
            resume: Whether to continue from the checkpoint in the folder.
            on_begin: Function that receives the folder and the number of trials in it, before the first trial.
            on_trial: Function that receives each finished trial.

        Raises:
            ConfigurationError: A setting is rejected, or the policy does not learn.
            OutputError: The folder already holds a run, or holds none that can be resumed.
            DeviceError: A device failed, or the supervisor tripped on a rig.
        """
        folder, subject = RunFolder(Path(out)), training.Subject.of(self.config, policy)
        checkpoint, first = None, 0
        with ExitStack() as kept:
            if resume:
                kept.enter_context(folder.writing(again=True))
                checkpoint = training.Checkpoint.load(folder)
                first = checkpoint.next_trial
                training.require_same_run(self.config, subject.name, folder)
            else:
                folder.require_free()
            require_usable(self.config, self.ready, self.rig_file)
            perception = subject.perception(self.config, checkpoint)
            with self.opened() as rig, ExitStack() as opened:
                if perception is None:
                    self.notify(f"fitting perception on {self.config.perception.fit_trials} random-walk trials")
                    perception = fitted_perception(self.config, self.ready, rig)
                learning = subject.policy(self.config, perception)
                if checkpoint is None:
                    self.begin(kept, folder, "train", trials=trials, policy=subject.name)
                else:
                    training.resume_from(checkpoint, learning, rig)
                    training.cut_back(folder, first)
                    self._notify_part()
                recording = self.record(kept, opened, folder)
                trainer = training.Trainer(self.config, folder, self.ready, rig, perception, learning, first, recording)
                trainer.checkpoint()
                on_begin(folder, first)
                trainer.train(trials, on_trial)
                trainer.save_policy()
            rows, summary = training.write_training(self.config, folder, trials)
        self.policy = folder.path / "policy.json"
        return RunResult(rows, summary, not trainer.interrupted, folder, recording.losses, recording.timing)

    @contextmanager
    def opened(self) -> Iterator[Rig]:
        """Yield the rig, which stays open until the context exits."""
        with self:
            yield self.rig

    def begin(self, kept: ExitStack, folder: RunFolder | None, command: str, **facts: Any) -> None:
        """Create the folder, lock it until ``kept`` closes, and write ``run.toml`` with further data about the run."""
        if folder is not None:
            kept.enter_context(folder.writing())
            if self.rig_file:
                file = RigFile.load(Path(self.rig_file))
                facts["rig"] = f"rig {file.name!r} with {'emulated' if file.emulated else 'real'} devices"
            folder.write("run.toml", training.run_toml(self.config, command, **facts))
        self._notify_part()

    def record(self, kept: ExitStack, opened: ExitStack, folder: RunFolder | None) -> Recording:
        """Start recording and, on a rig, real-time scheduling until ``opened`` closes; ``kept`` then reports losses."""
        config, recorder = self.config, None
        if folder is not None:
            recorder = folder.recorder(config.recording, opened)
        if recorder is not None:
            kept.push(lambda *raised: self._notify_losses(recorder.losses, raised[1]))
        session = opened.enter_context(RealTimeSession(config.real_time)) if self.rig_file else None
        for grant in () if session is None else session.request_results:
            self.notify(str(grant))
        return Recording(recorder, session, self.live)

    def _notify_part(self) -> None:
        config = self.config
        own = [limits_line(config.supervision, config.task)] if self.rig_file else inertia_lines(config.arm)
        weak = *weakened_lines(config.supervision), *validity_lines(config.cell)
        for line in (config.part.describe(), *own, *weak):
            self.notify(line)

    def _notify_losses(self, losses: Sequence[str], error: BaseException | None = None) -> None:
        """Report recording failures in addition to the error that ended the run, unless a full disk caused both."""
        if losses and isinstance(error, OSError):
            raise PalpateError(f"recording: {losses[0]}; earlier results are kept") from error
        for problem in losses[:_MOST_LOSSES]:
            self.notify(f"recording: {problem}")
        if len(losses) > _MOST_LOSSES:
            self.notify(f"recording: and {len(losses) - _MOST_LOSSES} more like these")


def note(line: str) -> None:
    """Print a line for the user; do nothing if the stream is closed."""
    with suppress(OSError):
        sys.stderr.write(f"palpate: {line}\n")
