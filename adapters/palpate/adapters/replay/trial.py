"""Run the core for a recorded trial on any ports, and record the trial again."""

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from typing_extensions import override

from palpate.adapters.config import RecordingConfig
from palpate.adapters.log import LogMessage, Sink, TrialRecorder
from palpate.adapters.replay.rebuild import Rebuilt
from palpate.adapters.replay.tape import Tape
from palpate.core.control_loop import LoopObserver, run_trial
from palpate.core.ports import Ports, WorldRecord
from palpate.core.trial import INTERRUPT, Task, TrialReport


class ReplayedRecords(Sink):
    """Sink that stores the records of one trial by kind, except for ticks, which the ports compare."""

    takes_ticks = False

    def __init__(self) -> None:
        self.losses = []
        self.of: dict[type, list[Any]] = defaultdict(list)

    @override
    def open(self, path: Path, metadata: dict[str, str]) -> None:
        self.of.clear()

    @override
    def put(self, message: LogMessage) -> None:
        self.of[type(message.record)].append(message.record)

    @override
    def close(self) -> None: ...


@dataclass(frozen=True)
class ReplayedTrial:
    """A trial that is being run again, with its records and, if requested, another recorder and its log name."""

    tape: Tape
    rebuilt: Rebuilt
    out: tuple[TrialRecorder, str] | None = None
    made: ReplayedRecords = field(default_factory=ReplayedRecords)

    def run(
        self,
        ports: Ports,
        world: WorldRecord,
        facts: Callable[[TrialReport], dict[str, Any]],
        observers: Sequence[LoopObserver] = (),
    ) -> TrialReport:
        """Run the trial. ``facts`` returns the end record's fields that the core lacks."""
        rebuilt = self.rebuilt
        recorders = [TrialRecorder(self.made, Path(), RecordingConfig())]
        observers = [*observers, _Interrupts(self.tape, rebuilt.task), self._begin(recorders[0], world, "")]
        if self.out is not None:
            recorder, name = self.out
            recorders.append(recorder)
            differences = self.tape.differences
            observers.append(self._begin(recorder, world, name, lambda: differences.first_command_tick is not None))
        try:
            report = run_trial(rebuilt.task, ports, rebuilt.setup, rebuilt.supervisor, observers)
        except BaseException as error:
            for recorder in recorders:
                recorder.fail(rebuilt.task.report, error)
            raise
        for recorder in recorders:
            recorder.end(report, facts(report))
        return report

    def _begin(
        self, recorder: TrialRecorder, world: WorldRecord, name: str, off_path: Callable[[], bool] = lambda: False
    ) -> LoopObserver:
        rebuilt = self.rebuilt
        baseline = rebuilt.baseline or ("recorded decisions" if rebuilt.recorded_decisions else "")
        recorder.of(
            "what-if", rebuilt.config, rebuilt.ready, rebuilt.task, rebuilt.perception, rebuilt.policy,
            name=baseline, frozen=rebuilt.frozen, derived_from=self.tape.log.path,
        )  # fmt: skip
        return recorder.begin(rebuilt.setup, world, name, off_path)


class _Interrupts(LoopObserver):
    """Observer that interrupts the task at the recorded ticks."""

    def __init__(self, tape: Tape, task: Task) -> None:
        self._task = task
        self._at = {event.tick for event in tape.log.events if event.name == INTERRUPT}

    @override
    def waited(self, tick: int, deadline_ns: int) -> None:
        if tick in self._at:
            self._task.interrupt()
