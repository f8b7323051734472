"""Logs of what-ifs: like recordings, but all that follows the first other command says that it is counterfactual."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from palpate.adapters.recording.trials import TrialRecorder
from palpate.adapters.replay.rebuild import Rebuilt
from palpate.adapters.replay.tape import Tape
from palpate.adapters.rig import World
from palpate.core.cycle import Ports


class WhatIfRecording:
    """Records one what-if, or nothing.

    Args:
        recorder: Where to; None records nothing.
        name: Name of the log, without its ending.

    Attributes:
        truth: Fields of the end record that only a simulator can fill; to be set before the trial is left.
    """

    def __init__(self, recorder: TrialRecorder | None = None, name: str = "") -> None:
        self._recorder, self._name = recorder, name
        self.truth: dict[str, Any] = {}

    @contextmanager
    def of(self, tape: Tape, rebuilt: Rebuilt, world: World) -> Iterator[Callable[[Ports], Ports]]:
        """While inside, the trial runs over the ports that the given function makes of ports."""
        recorder, log = self._recorder, tape.log
        if recorder is None:
            yield lambda ports: ports
            return
        recorder.of(
            "what-if", rebuilt.config, rebuilt.ready, rebuilt.task, rebuilt.perception, rebuilt.policy,
            name=rebuilt.comparator, frozen=rebuilt.frozen, derived_from=log.path,
        )  # fmt: skip

        def left() -> bool:
            return tape.differences.first_command_tick is not None

        try:
            yield lambda ports: recorder.begin(rebuilt.setup, ports, world, self._name, left)
        except BaseException as error:
            recorder.fail(rebuilt.task.report, error)
            raise
        recorder.end(rebuilt.task.report, self.truth)
