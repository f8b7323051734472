"""Settings for learning in grid worlds."""

from dataclasses import dataclass
from typing import Annotated, Any, Final

from typing_extensions import override

from palpate.adapters.config.described import RARE
from palpate.core.policy import HmmParameters, QParameters, SarsaParameters, TemperatureSchedule
from palpate.core.ports import LearningRate, OneOf, Range, Settings, Temperature, TemperatureDecay, require_floor
from palpate.simulation.grid import STEP_LIMIT

TRIALS: Final = 1500
"""Number of trials in a run (paper, section 4)."""
RATES: Final = {"q": (0.5, 20.0, 0.05), "sarsa": (0.1, 0.0, 0.0)}
"""Learning rate, visits that halve it, and minimum, by learner. They worked well with every kind of state.

These values were chosen with network seeds 0 to 3 and learning seeds 1000 to 1003.
"""

HMM: Final = "hmm"
"""Name of the learner with the displacement HMM."""
LEARNERS: Final = (*RATES, HMM)
INITIAL: Final = {"q": -4.0, "sarsa": 0.0}
"""Initial Q for each learner. With -4, which is close to the cost of reaching the goal, Q-learning over
automaton states needs half as many trials as with 0."""


@dataclass(frozen=True)
class GridLearning(Settings):
    """Learner settings. Each action costs 1, and exploration is Boltzmann, as in the insertion task."""

    learner: Annotated[str, OneOf(*LEARNERS)] = "q"
    """q: Q-learning; sarsa: Sarsa(lambda) with replacing traces; hmm: a hidden Markov model over the displacement from
    the goal, with a belief and a plan."""
    alpha: Annotated[LearningRate | None, RARE] = None
    """Constant learning rate. Default: q 0.5, halved after 20 visits, down to 0.05; sarsa 0.1 throughout."""
    temperature: Annotated[Temperature, RARE] = 0.5
    """Exploration temperature in the first trial."""
    temperature_decay: Annotated[TemperatureDecay, RARE] = 0.995
    """Factor applied to the exploration temperature after each trial."""
    temperature_floor: Annotated[Temperature, RARE] = 0.1
    """Minimum exploration temperature."""
    trace_decay: Annotated[float, Range(0.0, 1.0), RARE] = 0.8
    """Trace decay (lambda) for sarsa."""
    step_limit: Annotated[int, Range(1, 1_000_000), RARE] = STEP_LIMIT
    """Maximum number of steps in a trial."""
    reach: Annotated[int, Range(1, 200), RARE] = 10
    """Maximum displacement from the goal along x or y that the hmm learner considers, in cells."""

    @override
    def check(self) -> None:
        is_free = self.alpha is None or self.learner != HMM
        self.require("alpha", is_free, f"left out: {HMM} learns a model, not a table")
        require_floor("temperature_floor", self.temperature_floor, self.temperature, "temperature")

    def parameters(self) -> QParameters:
        """Return the parameters for a tabular learner."""
        alpha, visits, floor = RATES[self.learner] if self.alpha is None else (self.alpha, 0.0, 0.0)
        common: dict[str, Any] = {
            "alpha": alpha, "alpha_visits": visits, "alpha_floor": floor, "gamma": 1.0,
            "initial_value": INITIAL[self.learner],
            "temperature": TemperatureSchedule(self.temperature, self.temperature_decay, self.temperature_floor),
        }  # fmt: skip
        if self.learner == "sarsa":
            return SarsaParameters(**common, trace_decay=self.trace_decay)
        return QParameters(**common)

    def hmm(self) -> HmmParameters:
        """Return the parameters for the learner with a hidden Markov model."""
        return HmmParameters(reach=self.reach)
