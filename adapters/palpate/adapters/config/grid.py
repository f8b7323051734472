"""Settings of learning in grid worlds."""

from dataclasses import dataclass
from typing import Annotated, Final

from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.policy import HmmParameters, QParameters, SarsaParameters, TemperatureSchedule
from palpate.core.ports import (
    HalvingVisits,
    LearningRate,
    OneOf,
    Range,
    Settings,
    Temperature,
    TemperatureDecay,
    require_floor,
)
from palpate.simulation.grid import STEP_LIMIT

TRIALS: Final = 1500
"""Trials of a run (paper, section 4)."""
RATES: Final = {"q": (0.5, 20.0, 0.05), "sarsa": (0.1, 0.0, 0.0)}
"""Of each learner the learning rate, the visits that halve it and its floor that did well with all kinds of state.

Chosen on seeds 0 to 3 of networks and 1000 to 1003 of learning.
"""

HMM: Final = "hmm"
"""The learner with the displacement HMM."""
LEARNERS: Final = (*RATES, HMM)
BACK_OFF: Final = {"q": 20.0, "sarsa": 0.0}
"""Of each learner the visits after which a state counts as much as its symbol.

Chosen, with the temperature, on seeds 0 to 7 of networks and 1000 to 1107 of learning.
"""


@dataclass(frozen=True)
class GridLearning(Settings):
    """How the agent learns. The penalty of an action is 1 and exploration is Boltzmann's, as in the insertion task."""

    learner: Annotated[str, OneOf(*LEARNERS)] = "q"
    """q: Q-learning; sarsa: Sarsa(lambda) with replacing traces; hmm: a hidden Markov model over the displacement from
    the goal, with a belief and a plan."""
    alpha: LearningRate | None = None
    """Constant learning rate. Without it: q 0.5, halved by 20 visits, down to 0.05; sarsa 0.1 throughout."""
    temperature: Temperature = 0.5
    """Exploration temperature of the first trial."""
    temperature_decay: TemperatureDecay = 0.995
    """Its factor from one trial to the next."""
    temperature_floor: Temperature = 0.1
    """Its lowest value."""
    back_off: HalvingVisits | None = None
    """Visits after which a state's own experience counts as much as that of its last symbol, which stands in for it
    until then; 0 for never. Without it: q 20, sarsa never."""
    trace_decay: Annotated[float, Range(0.0, 1.0)] = 0.8
    """Lambda of sarsa."""
    step_limit: Annotated[int, Range(1, 1_000_000)] = STEP_LIMIT
    """Steps after which a trial ends without the goal."""
    reach: Annotated[int, Range(1, 200)] = 10
    """Largest displacement from the goal along x or y that the learner hmm considers, in cells."""

    @override
    def check(self) -> None:
        if self.alpha is not None and self.learner == HMM:
            raise ConfigurationError("alpha", self.alpha, f"none; {HMM} learns a model, not a table")
        if self.back_off and self.learner != "q":
            raise ConfigurationError("back_off", self.back_off, "0; only the learner q can back off")
        require_floor("temperature_floor", self.temperature_floor, self.temperature, "temperature")

    @property
    def back_off_visits(self) -> float:
        """The setting, or its default."""
        return BACK_OFF.get(self.learner, 0.0) if self.back_off is None else self.back_off

    def parameters(self) -> QParameters:
        """Settings of a learner with a table."""
        alpha, visits, floor = RATES[self.learner] if self.alpha is None else (self.alpha, 0.0, 0.0)
        schedule = TemperatureSchedule(self.temperature, self.temperature_decay, self.temperature_floor)
        if self.learner == "sarsa":
            return SarsaParameters(
                alpha=alpha, gamma=1.0, temperature=schedule, alpha_visits=visits, alpha_floor=floor,
                trace_decay=self.trace_decay,
            )  # fmt: skip
        return QParameters(alpha=alpha, gamma=1.0, temperature=schedule, alpha_visits=visits, alpha_floor=floor)

    def hmm(self) -> HmmParameters:
        """Settings of a learner that models hidden states."""
        return HmmParameters(reach=self.reach)
