from pathlib import Path

import numpy as np
import pytest

from palpate.adapters.config import RecordingConfig
from palpate.adapters.experiments import ScoredTrial, build_perception, task_actions
from palpate.adapters.experiments.teaching import Shown, Teacher, slowed, teach_trials
from palpate.adapters.log import TrialRecorder, read_log
from palpate.adapters.mujoco import SimulatedRig
from palpate.adapters.replay.engine import Verdict, replay
from palpate.adapters.replay.rebuild import Rebuilder
from palpate.core.motion import Kinematics, ToolGeometry, arm_named
from palpate.core.policy import Observation
from palpate.core.trial import Outcome
from tests.unit.adapters.experiments.teaching.test_teacher import Scripted
from tests.unit.adapters.samples import QUICK, ready_pose

SLOW = slowed(QUICK)
PERCEPTION = build_perception(SLOW)


class Letting(Scripted):
    """Lets the button go as soon as this is noted, in the first trial."""

    def __init__(self, event: str) -> None:
        super().__init__()
        self.event, self.trials = event, 0
        self.teacher: Teacher

    def wait(self) -> None:
        self.trials += 1

    @property
    def held(self) -> bool:
        if self.trials != 1 or self.teacher.task is None:
            return True
        events = self.teacher.task.report.events
        return not any(event.name == self.event for event in events)

    def step(self, observation: Observation) -> int | None:
        return 0 if self.held else None


@pytest.mark.parametrize("event", ["tare", "contact"])
def test_a_button_that_is_let_go_ends_a_trial_where_the_arm_moves_by_itself_and_rests_where_it_is_led(
    event: str, tmp_path: Path
) -> None:
    hand, done = Letting(event), list[tuple[Outcome | None, list[Shown]]]()
    hand.teacher = Teacher(hand, PERCEPTION.states, task_actions(SLOW), lambda seen, state: None)

    def keep(scored: ScoredTrial, shown: list[Shown]) -> None:
        done.append((scored.report.outcome, shown))

    recorder = TrialRecorder.into(tmp_path, RecordingConfig())
    assert recorder is not None
    with SimulatedRig(SLOW, ready_pose()) as rig, recorder:
        rows = teach_trials(SLOW, ready_pose(), rig, PERCEPTION, hand.teacher, 2, keep, recorder)
    assert [row.trial for row in rows] == [0, 1]
    (first, shown), (second, _) = done
    led = event == "contact"
    assert (first, shown) == (Outcome.TIME_LIMIT if led else Outcome.INTERRUPTED, [])
    assert second is not Outcome.INTERRUPTED
    fastest = 0.0
    for path in sorted(tmp_path.glob("*.mcap")):
        assert replay(read_log(path), Rebuilder()).verdict is Verdict.EQUAL
        fastest = max(fastest, tip_speed_m_s(path))
    assert fastest < 0.02


def tip_speed_m_s(path: Path) -> float:
    """Greatest speed of the commanded tip, from tick to tick."""
    kinematics, places = Kinematics(arm_named(SLOW.arm), ToolGeometry()), []
    for record in read_log(path).records():
        if record.applied is not None:
            kinematics.update(record.applied.position_rad)
            places.append(kinematics.tip_in_base.translation.copy())
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).max()) * 140.0
