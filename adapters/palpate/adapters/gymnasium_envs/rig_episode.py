"""Trials on a rig, decision by decision, in real time: the control loop runs in a thread of its own.

It opens, records and supervises as ``palpate run`` does, into such a folder. The agent's thread waits for what the loop
shows it; the loop hardly waits for the agent (:mod:`~palpate.adapters.gymnasium_envs.handover`).
"""

import queue
import sys
import threading
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from typing_extensions import override

from palpate.adapters.config import RunConfig, without_world
from palpate.adapters.experiments import (
    RunFolder,
    TrialRow,
    build_insertion,
    next_free_folder,
    open_rig,
    ready_pose,
    require_limits,
    require_sound,
    require_usable,
    run_scored_trial,
    run_toml,
    simulated_perception,
    supervisor_of,
    warm_up,
    write_evaluation,
)
from palpate.adapters.gymnasium_envs.episode import MOST_SKIPPED, SOURCE, Episodes, NotRunningError, without_decision
from palpate.adapters.gymnasium_envs.handover import Handover
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.adapters.log import TrialRecorder
from palpate.adapters.signals import on_ending_signal
from palpate.core.errors import LifecycleError, require_in
from palpate.core.policy import Decision
from palpate.core.ports import Rig
from palpate.core.supervision import limits_line, weakened_lines
from palpate.core.tasks.insertion import InsertionTask
from palpate.core.trial import ReadyPose

_COMMAND: Final = "run"


class RigEpisodes(Episodes):
    """A rig, and trials on it in real time.

    Args:
        config: The run's configuration; what it says of the simulated cell is left aside.
        out: Folder for the recording, as ``palpate run`` leaves it; empty takes the next free one below ``runs``.
        limit_s: How long an agent may take for a decision before the arm is stopped and the rig latched.
        made: Makes the rig, not entered, of configuration, ready pose and rig file.

    Raises:
        ConfigurationError: A setting is refused.
        DeviceError: A device failed.
        LifecycleError: This is not the main thread, where alone a rig can be opened.
    """

    def __init__(
        self,
        config: RunConfig,
        rig_file: str,
        out: str = "",
        limit_s: float = 0.3,
        made: Callable[[RunConfig, ReadyPose, str], Rig] = open_rig,
    ) -> None:
        require_in("decision_limit_s", limit_s, 0.01, 60.0)
        if threading.current_thread() is not threading.main_thread():
            # Signals, the operator's among them, reach a program's main thread only.
            raise LifecycleError("rig", "in another thread", "open()", "make the environment in the main thread")
        config = without_world(config)
        ready = ready_pose(config)
        require_usable(config, ready, rig_file)
        super().__init__(config)
        self.folder = RunFolder(Path(out)) if out else next_free_folder(f"runs/{config.scenario}-{SOURCE}")
        self.folder.require_free()
        self._desk = Handover(limit_s)
        self._desk.look = self._look
        self._asked: queue.SimpleQueue[tuple[RunConfig, int] | None] = queue.SimpleQueue()
        self._rows: list[TrialRow] = []
        self._moment: tuple[Any, dict[str, Any]] | None = None
        self._settled, self._begun, self._running = 0, 0, False
        self._kept, self._opened = ExitStack(), ExitStack()
        self._recorder: TrialRecorder | None = None
        rig = made(config, ready, rig_file)
        # That of an agent that was trained in the simulator.
        self.perception = simulated_perception(config, ready)
        warm_up(config, ready)
        with ExitStack() as kept, ExitStack() as opened:
            self.rig = opened.enter_context(rig)
            require_limits(config, ready, rig.sensor_facts)
            kept.enter_context(self.folder.writing())
            kept.callback(self._finish)
            self.folder.write("run.toml", run_toml(config, _COMMAND, policy=SOURCE, rig=rig_file))
            # Real time does not wait, whatever is configured.
            self._recorder = self.folder.recorder(replace(config.recording, when_full="drop"), opened)
            self.task: InsertionTask = build_insertion(config, ready, self.perception, self._desk)
            self._supervisor = supervisor_of(rig, config, ready)
            if self._recorder is not None:
                self._recorder.of(_COMMAND, config, ready, self.task, self.perception, self._desk, name=SOURCE)
            self._loop = threading.Thread(target=self._serve, name="control loop", daemon=True)
            self._loop.start()
            opened.callback(self._end_loop)
            # By default the process would be gone at once, and the arm left at its last set-point.
            opened.enter_context(on_ending_signal(_terminate, always=False))
            self._kept, self._opened = kept.pop_all(), opened.pop_all()

    # The agent's side.

    @property
    @override
    def running(self) -> bool:
        return self._running

    @override
    def begin(self, seed: int, trial: int) -> None:
        self._let_go()
        self.config = replace(self.config, seed=seed)
        for skipped in range(MOST_SKIPPED):
            self.trial, self.skipped = trial + skipped, skipped
            self._desk.begin()
            self._asked.put((self.config, self.trial))
            self._await()
            if self._running:
                return
        raise without_decision(self.report)

    @override
    def decide(self, decision: Decision) -> float:
        if not self._running:
            raise NotRunningError("no trial runs; begin one first")
        self._desk.give(decision)
        self._await()
        earned: float = self.seen()[1]["reinforcement"]
        return earned

    @override
    def seen(self) -> tuple[Any, dict[str, Any]]:
        if self._moment is None:
            raise NotRunningError("no trial has run yet")
        return self._moment

    def _await(self) -> None:
        self._running = False
        try:
            self._moment = self._desk.wait()
        except BaseException:
            # Ctrl-C too: nobody will ask for the next decision.
            self._let_go()
            raise
        self._running = not self.seen()[1]["outcome"]

    def _let_go(self) -> None:
        self._running = False
        self._desk.leave(self.rig.ports.arm.stop)

    @override
    def close(self) -> None:
        self._let_go()
        self._opened.close()
        self._kept.close()

    def _end_loop(self) -> None:
        self._asked.put(None)
        if threading.current_thread() is not self._loop:
            self._loop.join()

    def _finish(self) -> None:
        """Everything is closed: what the trials came to."""
        if self._rows:
            write_evaluation(self.config, self.folder, SOURCE, None, self._rows, len(self._rows))
        for trouble in () if self._recorder is None else self._recorder.troubles:
            _tell(f"recording: {trouble}")

    # The loop's side.

    def _serve(self) -> None:
        """Trials as they are asked for, in the thread of the loop."""
        with RealTimeSession(self.config.real_time) as session:
            limits = weakened_lines(self.config.supervision)
            for line in (*map(str, session.grants), limits_line(self.config.supervision, self.config.task), *limits):
                _tell(line)
            while (asked := self._asked.get()) is not None:
                try:
                    self._desk.end(self._run(*asked, session))
                except BaseException as error:
                    # Whatever it is, it is the agent's side that must be told.
                    self._desk.end(None, error)

    def _run(self, config: RunConfig, trial: int, session: RealTimeSession) -> tuple[Any, dict[str, Any]]:
        first = trial - self._begun
        self._settled, self._begun = 0, self._begun + 1
        scored = run_scored_trial(
            config, self.rig, self.task, trial, self._recorder, first, self._supervisor, session, (self._desk,)
        )
        self.folder.append_trial(scored, first)
        self._rows.append(TrialRow.of(scored, first))
        require_sound(self.rig, scored, first)
        return self._look(success=scored.success)

    def _look(self, *, success: bool = False) -> tuple[Any, dict[str, Any]]:
        """What the agent is shown: the observation, and what is known of the trial."""
        decisions, plain = self.report.decisions, self.plain_reinforcement
        # What the rests before it cost is the agent's own affair.
        new, self._settled = decisions[self._settled :], len(decisions)
        # Within a skill nothing is earned; where a trial ended in the middle of something, nothing was settled.
        earned = sum(one.reinforcement for one in new if one.reinforcement is not None)
        earned += plain if new and new[-1].reinforcement is None else 0.0
        known = self._known(success=success, earned=float(earned))
        late = {"peak_force_N": self.report.peak_force_N, "late_decisions": self._desk.late_decisions}
        return self.observe(self.task), {**known, **late}


def _terminate(number: int) -> None:
    """The program ends, but in order."""
    sys.exit(128 + number)


def _tell(text: str) -> None:
    # The loop's thread must not end because the terminal was closed.
    with suppress(OSError):
        sys.stderr.write(f"palpate: {text}\n")
