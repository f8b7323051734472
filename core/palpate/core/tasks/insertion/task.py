"""The insertion task: approach until contact, explore the surface, and insert to full depth.

The task is a state machine without I/O. At 140 Hz, it turns each :class:`~palpate.core.ports.values.Snapshot`
into one joint command. An external policy may choose an action between the two halves of a tick. The task uses port
data only. Encoders cannot measure the gripper's deflection, so the hole is detected by the loss of the reaction force
and confirmed by motion along the tool axis until there is contact again. The encoders' depth is corrected by the force
divided by the stiffness.
"""

from typing_extensions import override

from palpate.core.motion import TipMotion
from palpate.core.policy import EpisodeOutcome
from palpate.core.ports import Vector3
from palpate.core.tasks.contact import ContactTask, Monitor
from palpate.core.tasks.insertion.agent import Agent
from palpate.core.tasks.insertion.phases import Approach, Controllers, Equipment, Explore, Insert
from palpate.core.tasks.insertion.trial_state import InsertionState
from palpate.core.trial import ControlConfig, Measurement, Outcome, Phase, Purpose, TaskConfig, TrialSetup, generator


class InsertionTask(ContactTask):
    """Task that inserts a peg with one arm, trial by trial.

    Args:
        measurement: Measurement that transforms snapshots to the task frame.
    """

    _state: InsertionState

    def __init__(
        self,
        task: TaskConfig,
        control: ControlConfig,
        measurement: Measurement,
        motion: TipMotion,
        agent: Agent,
    ) -> None:
        self._agent = agent
        state, controllers = InsertionState(agent, measurement), Controllers.of(task, control)
        equipment = Equipment(task, measurement, motion, controllers, agent, state)
        monitor = Monitor(state, task, control, measurement.depth_step_m)
        super().__init__(task, measurement, motion, controllers.free, state, monitor)
        self._approach, self._explore = Approach(equipment, monitor), Explore(equipment, monitor)
        self._insert = Insert(equipment, monitor, control)

    @override
    def begin(self, setup: TrialSetup) -> None:
        # A policy may fail here, but the report exists by then.
        super().begin(setup)
        self._agent.begin(setup.index, generator(setup.seed, Purpose.POLICY, setup.index))
        self._state.agent_begun()
        self._explore.begin(setup.start_m)

    @override
    def choose(self) -> None:
        self._state.observation = None
        self._velocity_m_s = self._explore.choose()

    def _follow(self) -> None:
        phase = self._state.phase
        if phase is Phase.SETTLE:
            self._approach.enter()
            self._enter(Phase.APPROACH, self._approach)
        elif phase is Phase.APPROACH and self._approach.touched:
            self._explore.enter()
            self._enter(Phase.EXPLORE, self._explore, area=self._explore.area)
        elif phase in (Phase.APPROACH, Phase.EXPLORE):
            self._insert.enter()
            self._enter(Phase.INSERT, self._insert)
        else:
            self._explore.resume()
            self._enter(Phase.EXPLORE, self._explore, area=self._explore.area)

    def _may_end(self) -> bool:
        return self._state.phase is not Phase.EXPLORE or self._explore.countdown <= 1

    @override
    def conclude(self) -> None:
        # Not earlier: a trip at the last tick, or while the arm stops, would change the outcome.
        report = self._state.report
        self._agent.end(EpisodeOutcome(report.outcome is Outcome.INSERTED, self.tip_m, report.depth_m))

    @property
    def percept(self) -> tuple[int, int] | None:
        """Return the indices of the latest perceived symbol and state in this trial, or None before the first."""
        return self._agent.percept

    @property
    def goes_on(self) -> bool:
        """Return True if the observation from :meth:`sense` belongs to an earlier choice; no policy is consulted."""
        return self._agent.goes_on

    @property
    def turn_rad(self) -> Vector3:
        """Return the commanded orientation relative to the upright tool, (3,): tilt about x and y, yaw about z."""
        return self._motion.turn_rad
