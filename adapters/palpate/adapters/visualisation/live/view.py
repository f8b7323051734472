"""Trials in Rerun's viewer while they run: an observer of the control loop."""

from __future__ import annotations

import ctypes
import os
import signal
import socket
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Self

import rerun as rr
import rerun_cli
from typing_extensions import override

from palpate.adapters.config import RunConfig, to_toml
from palpate.adapters.experiments import TrialRow
from palpate.adapters.log import SCHEMA, DecisionEntry, EventEntry, StartRecord, TickRecord, TrialLog, dump_json, end_of
from palpate.adapters.visualisation.live.recording import Recording, layout
from palpate.adapters.visualisation.live.values import values_in
from palpate.core.control_loop import LoopObserver
from palpate.core.errors import ConfigurationError
from palpate.core.policy import PolicyDocument
from palpate.core.ports import AppliedCommand, JointCommand, Snapshot, World
from palpate.core.trial import ReadyPose, TrialReport

PORT: Final = 9876
"""The port at which Rerun's viewer looks by itself."""
_MEMORY: Final = "512MB"
"""What the server keeps for viewers that come late; then it drops the oldest."""


@dataclass(frozen=True)
class _Subject:
    config: RunConfig
    ready: ReadyPose
    world: Callable[[], World]
    document: Callable[[], PolicyDocument | None]


class LiveView(LoopObserver):
    """Shows trials while they run. A context manager.

    Args:
        server: Rerun's server process, which ends with the view.
    """

    def __init__(self, recording: Recording, server: subprocess.Popen[bytes] | None = None) -> None:
        self._recording, self._server = recording, server
        self._subject: _Subject | None = None
        self._report: TrialReport | None = None
        self._trial: TrialLog | None = None
        self._events = self._decisions = self._deadline_ns = 0

    @classmethod
    def serving(cls, port: int = 0) -> Self:
        """Serve viewers on this computer.

        Args:
            port: Where viewers connect; 0 for Rerun's usual one.

        Raises:
            ConfigurationError: The port is taken.
        """
        port = port or PORT
        try:
            with socket.socket() as tried:
                tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                tried.bind(("127.0.0.1", port))
        except OSError as error:
            accepted = f"a free port ({error.strerror}); --live-port chooses another"
            raise ConfigurationError("live_port", port, accepted) from error
        # A recording that serves itself listens on every address; Rerun's program takes one.
        program = next(iter(rerun_cli.__path__)) + "/rerun"
        words = ["--serve-grpc", "--bind", "127.0.0.1", "--port", str(port), "--server-memory-limit", _MEMORY]
        quiet = subprocess.DEVNULL
        server = subprocess.Popen(
            [program, *words], stdin=quiet, stdout=quiet, stderr=quiet, preexec_fn=_end_with_parent,
            # No usage statistics are sent from machines that test.
            env={**os.environ, "CI": "1"},
        )  # fmt: skip
        stream = rr.RecordingStream("palpate")
        stream.connect_grpc(f"rerun+http://127.0.0.1:{port}/proxy", default_blueprint=layout())
        return cls(Recording(stream), server)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._recording.__exit__(*error)
        if self._server is not None:
            self._server.kill()
            self._server.wait()

    def of(
        self,
        config: RunConfig,
        ready: ReadyPose,
        world: Callable[[], World],
        document: Callable[[], PolicyDocument | None] = lambda: None,
        earlier: Sequence[TrialRow] = (),
    ) -> None:
        """State what the next trials are trials of.

        Args:
            world: Gives the world of the present trial, with its true hole where the simulator knows it.
            document: Gives the policy with its present action values.
            earlier: Trials before, for the learning curve.
        """
        self._subject = _Subject(config, ready, world, document)
        self._recording.learned([row.exploration_time_s for row in earlier])

    @override
    def begun(self, start_ns: int, report: TrialReport) -> None:
        if self._subject is None:
            return
        config, ready = self._subject.config, self._subject.ready
        surroundings, policy = self._subject.world(), self._subject.document()
        start = StartRecord(
            schema=SCHEMA, command="live", config_toml=to_toml(config), arm=str(config.arm), model_sha256="",
            core_sha256="", seed=report.setup.seed, trial=report.setup.index, start_m=report.setup.start_m,
            ready_rad=tuple(ready.q_rad.tolist()), tip_rotation=tuple(ready.tip_rotation.ravel().tolist()),
            perception_json="", policy="", world=surroundings.kind, world_json=dump_json(surroundings.facts),
        )  # fmt: skip
        self._report, self._deadline_ns, self._events, self._decisions = report, start_ns, 0, 0
        self._trial = TrialLog("live view", 0, start)
        self._recording.begin(self._trial, start_ns, values_in(policy, None))

    @override
    def waited(self, tick: int, deadline_ns: int) -> None:
        self._deadline_ns = deadline_ns

    @override
    def sent(self, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> None:
        self._recording.tick(
            TickRecord(
                snapshot.tick, snapshot.time_ns, self._deadline_ns, snapshot.wrench, snapshot.joints,
                command.position_rad, applied,
            )
        )  # fmt: skip
        self._follow()

    @override
    def stopped(self, error: BaseException | None) -> None:
        report, trial = self._report, self._trial
        if report is None or trial is None:
            return
        self._follow()
        if report.outcome is not None:
            trial.end = end_of(report)
        self._recording.end()
        self._report = None

    def _follow(self) -> None:
        """Show what the report holds that is new."""
        report = self._report
        if report is None or (len(report.events) == self._events and len(report.decisions) == self._decisions):
            return
        for event in report.events[self._events :]:
            self._recording.event(EventEntry(tick=event.tick, name=event.name, detail=event.detail))
        for number in range(self._decisions, len(report.decisions)):
            self._recording.decision(DecisionEntry.of(number, report.decisions[number], report.temperature))
        self._events, self._decisions = len(report.events), len(report.decisions)


def _end_with_parent() -> None:
    set_death_signal = 1
    ctypes.CDLL(None).prctl(set_death_signal, signal.SIGKILL)
