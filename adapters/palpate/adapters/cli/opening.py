"""What the commands that run trials on a rig open, in this order."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from typing import TYPE_CHECKING

from palpate.adapters.cli.notices import print_grants, print_troubles, watched
from palpate.adapters.cli.options import RunOptions, TrainOptions
from palpate.adapters.config import RunConfig
from palpate.adapters.experiments import RunFolder, open_rig, require_limits, warm_up
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.adapters.log import TrialRecorder
from palpate.core.ports import Rig
from palpate.core.trial import ReadyPose

if TYPE_CHECKING:
    from palpate.adapters.visualisation.live import LiveView

Options = RunOptions | TrainOptions


def opened_rig(opened: ExitStack, options: Options, config: RunConfig, ready: ReadyPose) -> tuple[LiveView | None, Rig]:
    """The live view, if one is asked for, and the rig; until ``opened`` closes."""
    live = opened.enter_context(watched(options))
    closed = open_rig(config, ready, options.rig, options.acknowledge, accept_kinematics=options.accept_kinematics)
    if options.rig:
        warm_up(config, ready)
    rig = opened.enter_context(closed)
    require_limits(config, ready, rig.sensor_facts)
    return live, rig


def opened_recorder(
    opened: ExitStack,
    kept: ExitStack,
    options: Options,
    config: RunConfig,
    folder: RunFolder,
    live: LiveView | None,
) -> tuple[TrialRecorder | None, RealTimeSession | None]:
    """The recorder, and on a rig real time; until ``opened`` closes. When ``kept`` does, it is told what was lost."""
    # Real time does not wait, whatever is configured.
    recording = replace(config.recording, when_full="drop") if options.rig else config.recording
    recorder = folder.recorder(recording, opened, live)
    # On every way out: beside the error that ended the run.
    if recorder is not None:
        kept.callback(print_troubles, recorder.troubles)
    session = opened.enter_context(RealTimeSession(config.real_time)) if options.rig else None
    print_grants(session, config)
    return recorder, session
