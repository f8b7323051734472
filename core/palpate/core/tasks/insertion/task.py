"""The insertion task: approach to contact, exploration of the surface, insertion to full depth.

A state machine without I/O: one :class:`~palpate.core.ports.values.Snapshot` in, one joint command out, a tick of
140 Hz at a time. A tick has two halves with the choice of an action between them, for a chooser outside. It uses
port data only. Encoders cannot see the gripper's springs, so the hole is found by the loss of the reaction force and
confirmed by motion along the tool axis until contact again; depth is the encoders' depth corrected by force over
stiffness.
"""

from typing_extensions import override

from palpate.core.motion import TipMotion
from palpate.core.policy import Hindsight
from palpate.core.ports import Vector3
from palpate.core.tasks.contact import Monitor, TouchTask
from palpate.core.tasks.insertion.agent import Agent
from palpate.core.tasks.insertion.phases import Approach, Equipment, Explore, Insert, Laws
from palpate.core.tasks.insertion.trial_state import InsertionState
from palpate.core.trial import ControlConfig, Measurement, Outcome, Phase, Purpose, TaskConfig, TrialSetup, generator


class InsertionTask(TouchTask):
    """One arm's insertion, trial by trial.

    Args:
        measurement: From snapshots to the task frame.
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
        state, laws = InsertionState(agent, measurement), Laws.of(task, control)
        equipment = Equipment(task, measurement, motion, laws, agent, state)
        monitor = Monitor(state, task, control, measurement.depth_step_m)
        super().__init__(task, measurement, motion, laws.free, state, monitor)
        self._approach, self._explore = Approach(equipment, monitor), Explore(equipment, monitor)
        self._insert = Insert(equipment, monitor, control)

    @override
    def begin(self, setup: TrialSetup) -> None:
        # A policy may fail here: the trial has a report then.
        super().begin(setup)
        self._agent.begin(setup.index, generator(setup.seed, Purpose.POLICY, setup.index))
        self._state.agent_begun()
        self._explore.begin(setup.start_m)

    @override
    def choose(self) -> None:
        """Let the policy choose by what :meth:`sense` returned, ahead of :meth:`act`: for loops that time it apart.

        Raises:
            LifecycleError: There is no choice in this tick.
        """
        self._state.observation = None
        self._velocity_m_s = self._explore.choose()
        # The first tick of an action may doubt, too.
        self.expectation = self._state.expectation

    @override
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

    @override
    def _may_end(self) -> bool:
        return self._state.phase is not Phase.EXPLORE or self._explore.countdown <= 1

    @override
    def conclude(self) -> None:
        """The loop is done with the trial: the policy gets what it came to.

        Not as soon as the peg is in: a trip in that very tick, or while the arm comes to rest, makes it untrue.
        """
        report = self._state.report
        self._agent.end(Hindsight(report.outcome is Outcome.INSERTED, self.tip_m, report.depth_m))

    @property
    def percept(self) -> tuple[int, int] | None:
        """Symbol and state last perceived in this trial, as indices; None before the first."""
        return self._agent.percept

    @property
    def goes_on(self) -> bool:
        """Whether what :meth:`sense` returned is for a choice that was made before and goes on: no policy is asked."""
        return self._agent.goes_on

    @property
    def turn_rad(self) -> Vector3:
        """Commanded orientation against the upright tool, (3,): lean about x and y, yaw about z, task frame."""
        return self._motion.turn_rad
