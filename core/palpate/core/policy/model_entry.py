"""What a policy file holds of a learner by a model: its settings, and the trials that it learned from."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Annotated, Any, ClassVar, Self

from typing_extensions import override

from palpate.core.policy.base import Action
from palpate.core.policy.belief import BeliefLearner, BeliefParameters, TouchedTrial, TouchModel
from palpate.core.policy.hmm import HmmLearner, HmmParameters
from palpate.core.ports import Range, Settings


@dataclass(frozen=True, slots=True)
class Reach:
    """What of a task a belief has to know.

    Attributes:
        half_width_m: Half the side of the square about the nominal goal in which the hole, and the tip, may be.
    """

    half_width_m: float
    action_s: float


@dataclass(frozen=True, slots=True)
class ModelEntry(Settings):
    """Such a learner as the file has it. What it has fitted follows from the trials, and is not in it."""

    parameters: BeliefParameters | HmmParameters
    """Its settings."""
    trials_learned: Annotated[int, Range(0)]
    """Number of trials that it learned from."""
    trials: tuple[Mapping[str, Any], ...]
    """Those that it remembers, the oldest first."""

    def content(self) -> dict[str, Any]:
        """The entry as JSON has it."""
        return {"parameters": asdict(self.parameters), **self.state()}

    def state(self) -> dict[str, Any]:
        """What was learned, as the state of a learner."""
        return {"trials_learned": self.trials_learned, "trials": list(self.trials)}

    def unlearned(self) -> Self:
        """The same before it learned anything."""
        return replace(self, trials_learned=0, trials=())


@dataclass(frozen=True, slots=True)
class BeliefEntry(ModelEntry):
    """A belief over the hole's place; of its trials see :class:`~palpate.core.policy.belief.TouchedTrial`."""

    TABLE: ClassVar[str] = "belief"

    parameters: BeliefParameters

    @override
    def check(self) -> None:
        for number, trial in enumerate(self.trials):
            TouchedTrial.from_dict(f"belief.trials[{number}]", trial)

    @classmethod
    def of(cls, learner: BeliefLearner) -> Self:
        """What a live one has learned."""
        return cls(learner.parameters, **learner.get_state())

    def remembered(self) -> Self:
        """The same without the trials that it has no room for."""
        return replace(self, trials=self.trials[-self.parameters.memory_trials :])

    def touch_model(self) -> TouchModel | None:
        """The touch model that follows from the trials; None where they are too few."""
        return self.learner(Reach(1e-3, 0.1), frozen=True).model

    def learner(self, reach: Reach, *, frozen: bool) -> BeliefLearner:
        """The learner that has learned this, at work in a task."""
        learner = BeliefLearner(self.parameters, reach.half_width_m, reach.action_s, frozen=frozen)
        learner.set_state(self.state())
        return learner


@dataclass(frozen=True, slots=True)
class HmmEntry(ModelEntry):
    """A model of hidden states; of its trials see :class:`~palpate.core.policy.hmm.RecordedTrial`."""

    TABLE: ClassVar[str] = "hmm"

    parameters: HmmParameters

    @classmethod
    def of(cls, learner: HmmLearner) -> Self:
        """What a live one has learned."""
        return cls(learner.parameters, **learner.get_state())

    def learner(self, states: Sequence[str], actions: Sequence[Action], *, frozen: bool) -> HmmLearner:
        """The learner that has learned this, at work in a task with these states and actions.

        Raises:
            ConfigurationError: Trials with others, or displacements on no lattice.
        """
        learner = HmmLearner(states, actions, self.parameters, frozen=frozen)
        learner.set_state(self.state())
        return learner
