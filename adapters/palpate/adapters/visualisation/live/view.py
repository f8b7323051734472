"""Trials in Rerun's viewer while they run: an observer of the control loop."""

from __future__ import annotations

import ctypes
import os
import signal
import socket
import subprocess
from typing import Final, Self

import rerun as rr
import rerun_cli
from typing_extensions import override

from palpate.adapters.config import to_toml, with_options
from palpate.adapters.experiments import Trials, TrialsObserver
from palpate.adapters.log import (
    SCHEMA,
    DecisionEntry,
    EventEntry,
    StartRecord,
    TickRecord,
    TrialLog,
    dump_json,
    end_of,
    world_of,
)
from palpate.adapters.visualisation.live.recording import Recording, layout, values_in
from palpate.core.errors import ConfigurationError
from palpate.core.policy import document_of
from palpate.core.ports import AppliedCommand, JointCommand, Snapshot
from palpate.core.trial import TrialReport

PORT: Final = 9876
"""The port at which Rerun's viewer looks by itself."""
_MEMORY: Final = "512MB"
"""What the server keeps for viewers that come late; then it drops the oldest."""


class LiveView(TrialsObserver):
    """Shows trials while they run. A context manager.

    Args:
        server: Rerun's server process, which ends with the view.
        address: Where viewers connect.
    """

    def __init__(self, recording: Recording, server: subprocess.Popen[bytes] | None = None, address: str = "") -> None:
        self._recording, self._server, self.address = recording, server, address
        self._trials: Trials | None = None
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
        stream, address = rr.RecordingStream("palpate"), f"rerun+http://127.0.0.1:{port}/proxy"
        stream.connect_grpc(address, default_blueprint=layout())
        return cls(Recording(stream), server, address)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._recording.__exit__(*error)
        if self._server is not None:
            self._server.kill()
            self._server.wait()

    @override
    def of(self, trials: Trials) -> None:
        self._trials = trials

    @override
    def begun(self, start_ns: int, report: TrialReport) -> None:
        trials = self._trials
        if trials is None:
            return
        ready, world = trials.ready, world_of(trials.rig)
        start = StartRecord(
            schema=SCHEMA, command="live", config_toml=to_toml(with_options(trials.config)), arm=str(trials.config.arm),
            model_sha256="", core_sha256="", seed=report.setup.seed, trial=report.setup.index,
            start_m=report.setup.start_m, ready_rad=tuple(ready.q_rad.tolist()),
            tip_rotation=tuple(ready.tip_rotation.ravel().tolist()), perception_json="", policy=trials.name,
            world=world.kind, world_json=dump_json(world.facts),
        )  # fmt: skip
        document = None if trials.name else document_of(trials.policy, created_with={}, perception={})
        self._report, self._deadline_ns, self._events, self._decisions = report, start_ns, 0, 0
        self._trial = TrialLog("live view", 0, start)
        self._recording.begin(self._trial, start_ns, values_in(document, None))

    @override
    def waited(self, tick: int, deadline_ns: int) -> None:
        self._deadline_ns = deadline_ns

    @override
    def sent(self, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> None:
        self._recording.tick(TickRecord.of(self._deadline_ns, snapshot, command, applied))
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
