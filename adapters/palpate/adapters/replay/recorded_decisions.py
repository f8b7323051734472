"""Recorded decisions, for a trial of a policy whose code is missing."""

from collections.abc import Sequence

from typing_extensions import override

from palpate.adapters.log import TrialLog
from palpate.adapters.replay.tape import TapeEndError
from palpate.core.errors import LogError
from palpate.core.policy import Action, Decision, FixedPolicy, Observation, Spatial


class RecordedDecisions(FixedPolicy):
    """Returns the recorded decisions in order; the first ``observed`` grounds of each do not come from the policy."""

    def __init__(self, actions: Sequence[Action], problem: str, observed: int) -> None:
        super().__init__()
        self._actions, self.problem, self._observed = tuple(actions), problem, observed
        self.log: TrialLog | None = None

    @property
    @override
    def temperature(self) -> float | None:
        return None if self.log is None else self.log.start.temperature

    @override
    def choose(self, observation: Observation) -> Decision:
        # A skill is chosen once, but each of its actions is recorded.
        if self.log is None or observation.action_number >= len(self.log.decisions):
            raise TapeEndError("policy")
        told = self.log.decisions[observation.action_number]
        if told.index is not None and 0 <= told.index < len(self._actions):
            # Otherwise the log contradicts itself, which the comparison of decisions detects.
            return Decision(self._actions[told.index], told.index, told.source, told.grounds[self._observed :])
        if len(told.displacement_m) != 2 or told.index is not None:
            problem = "does not say where the action leads"
            raise LogError(self.log.path, f"decision {told.number}", problem, "it was altered")
        x, y = told.displacement_m
        spatial = Spatial.of(told.law, told.spatial) if told.law else None
        return Decision(Action(told.action, (x, y), spatial), None, told.source, told.grounds[self._observed :])
