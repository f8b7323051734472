"""Learning settings for the insertion task."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Final

from typing_extensions import override

from palpate.adapters.files import json_of_file
from palpate.core.policy import HmmParameters
from palpate.core.policy.belief import BeliefParameters
from palpate.core.ports import (
    Discount,
    HalvingVisits,
    LearningRate,
    OneOf,
    Range,
    Settings,
    Temperature,
    TemperatureDecay,
    require_floor,
)

_OF_TABLES: Final = ("q-learning", "sarsa", "options")
OF_SOME: Final[Mapping[str, tuple[str, ...]]] = {
    "optimistic_prior": ("options",),
    "trace_decay": ("sarsa", "options"),
    "belief": ("belief",),
    "hmm": ("hmm",),
    **dict.fromkeys(
        (
            "alpha", "alpha_visits", "alpha_floor", "gamma", "initial_value", "temperature", "temperature_decay",
            "temperature_floor", "temperature_in_use",
        ),
        _OF_TABLES,
    ),
}  # fmt: skip
"""Settings that apply only to some learners, and the names of these learners."""


def learner_in(path: str) -> str:
    """Return the learner that trained the policy stored in a file, or an empty string if it is not a policy file."""
    try:
        document = json_of_file(path)
    except (OSError, ValueError):
        return ""
    if not isinstance(document, dict) or not str(document.get("schema")).startswith("palpate.policy/"):
        return ""
    learner = document.get("learner")
    return str(learner.get("kind") or "") if isinstance(learner, dict) else ""


@dataclass(frozen=True)
class LearningConfig(Settings):
    """Settings for the learner, its reinforcement and the programmed states."""

    TABLE: ClassVar[str] = "learning"

    alpha: LearningRate = 0.3
    """Learning rate."""
    alpha_visits: HalvingVisits = 50.0
    """Number of visits after which the learning rate of a state-action pair is halved; 0 keeps it constant."""
    alpha_floor: Annotated[float, Range(0.0, 1.0)] = 0.05
    """Minimum learning rate."""
    gamma: Discount = 1.0
    """Discount factor."""
    initial_value: Annotated[float, Range(-1e6, 1e6)] = -5.0
    """Q before the first visit, close to the cost of reaching the goal. Values that start at 0 fall for hundreds
    of trials and mask the best action."""
    optimistic_prior: Annotated[float, Range(0.0, 1e6)] = 0.0
    """Optimistic prior in Q for the options that the task's rule would choose; with 0, all options start equal."""
    temperature: Annotated[float, Range(0.0, 1e6, above=True)] = 5.0
    """Boltzmann temperature in the first trial."""
    temperature_decay: TemperatureDecay = 0.95
    """Factor applied to the temperature after each trial."""
    temperature_floor: Temperature = 0.2
    """Minimum temperature during training, because states are aliased and a greedy policy could loop."""
    temperature_in_use: Temperature = 0.1
    """Policy temperature when not learning, if lower than the minimum during training."""
    trace_decay: Annotated[float, Range(0.0, 1.0)] = 0.8
    """Trace decay (lambda) for sarsa and options."""
    reinforcement: Annotated[str, OneOf("action-penalty", "effort", "time")] = "action-penalty"
    """action-penalty: -1 per action; effort: also penalises force beyond the pressing force; time: -10 per second."""
    effort_per_N_s: Annotated[float, Range(-1e6, 0.0)] = -1.0
    """Reward per newton second of force beyond the pressing force."""
    belief: BeliefParameters = field(default_factory=BeliefParameters)
    hmm: HmmParameters = field(default_factory=HmmParameters)
    programmed: dict[str, str] = field(default_factory=dict)
    """Programmed states, which are not learned, as a table from state name to action name."""
    examples: str = ""
    """CSV file with columns state and action, such as a run's decisions.csv; it sets the actions for its states."""

    @override
    def check(self) -> None:
        require_floor("learning.alpha_floor", self.alpha_floor, self.alpha, "alpha")
        require_floor("learning.temperature_floor", self.temperature_floor, self.temperature, "temperature")
