"""A lesson: trials in which a person chooses, on a rig or in the simulator."""

from collections.abc import Callable
from dataclasses import replace
from math import sqrt
from typing import Final

from palpate.adapters.config import RunConfig
from palpate.adapters.experiments.build import build_task, supervisor_of
from palpate.adapters.experiments.evaluation import FIRST_EVALUATION_TRIAL
from palpate.adapters.experiments.results import TrialRow
from palpate.adapters.experiments.teaching.examples_file import Shown
from palpate.adapters.experiments.teaching.teacher import HeldArm, Teacher
from palpate.adapters.experiments.trial import ScoredTrial, interrupting, require_sound, run_scored_trial
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.adapters.log import PERSON, TrialRecorder
from palpate.core.perception import Perception
from palpate.core.ports import Rig
from palpate.core.trial import Outcome, ReadyPose

FASTEST_MM_S: Final = 20.0
"""Faster than this no arm moves that a person stands beside."""


def slowed(config: RunConfig) -> RunConfig:
    """The same with speeds for an arm that a person stands beside, if they were higher.

    The travel speed bounds the way across the plate, and along the tool the pressing and the heaving upon it.
    """
    travel_mm_s = min(config.task.travel_speed_mm_s, FASTEST_MM_S * sqrt(0.2))
    retract_mm_s = min(config.supervision.retract_speed_mm_s, FASTEST_MM_S)
    return replace(
        config,
        task=replace(config.task, travel_speed_mm_s=travel_mm_s),
        supervision=replace(config.supervision, retract_speed_mm_s=retract_mm_s),
    )


def teach_trials(
    config: RunConfig,
    ready: ReadyPose,
    rig: Rig,
    perception: Perception,
    teacher: Teacher,
    trials: int,
    on_trial: Callable[[ScoredTrial, list[Shown]], None],
    recorder: TrialRecorder | None = None,
    session: RealTimeSession | None = None,
) -> list[TrialRow]:
    """Let a person choose in trial after trial, until there are enough or the person ends it.

    A trial that was cut short, by a button that was let go, counts as one; what was shown in the last, unfinished one
    of a lesson that is ended is left out.

    Raises:
        DeviceError: A device failed, the arm was stopped, the supervisor tripped, or the gamepad is gone.
    """
    hand, rows = teacher.hand, list[TrialRow]()
    rig.ports = replace(rig.ports, arm=HeldArm(rig.ports.arm, teacher))
    supervisor = supervisor_of(rig, config, ready)
    with interrupting(hand.end):
        for number in range(trials):
            hand.wait()
            if hand.ended():
                break
            # One that was interrupted would end any later trial at once.
            teacher.task = task = build_task(config, ready, perception, teacher)
            teacher.on_the_way = True
            if recorder is not None:
                recorder.of("teach", config, ready, task, perception, teacher, name=PERSON)
            scored = run_scored_trial(
                config, rig, task, FIRST_EVALUATION_TRIAL + number, recorder, FIRST_EVALUATION_TRIAL, supervisor,
                session, (teacher,),
            )  # fmt: skip
            if hand.ended() and scored.report.outcome is Outcome.INTERRUPTED:
                break
            rows.append(TrialRow.of(scored, FIRST_EVALUATION_TRIAL))
            on_trial(scored, teacher.shown)
            require_sound(scored, FIRST_EVALUATION_TRIAL)
    return rows
