"""What a policy file holds of a belief: its settings, and the trials that it learned from."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Annotated, Any, ClassVar, Self

from typing_extensions import override

from palpate.core.policy.belief import BeliefLearner, BeliefParameters, TouchedTrial, TouchModel
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
class BeliefEntry(Settings):
    """A belief as the file has it. Model and prior follow from the trials, and are not in it."""

    TABLE: ClassVar[str] = "belief"

    parameters: BeliefParameters
    """Its settings."""
    trials_learned: Annotated[int, Range(0)]
    """Number of trials that it learned from."""
    trials: tuple[Mapping[str, Any], ...]
    """Those that it remembers, the oldest first; see :class:`~palpate.core.policy.belief.TouchedTrial`."""

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

    def content(self) -> dict[str, Any]:
        """The belief as JSON has it."""
        return {"parameters": asdict(self.parameters), **self.state()}

    def state(self) -> dict[str, Any]:
        """What was learned, as the state of a learner."""
        return {"trials_learned": self.trials_learned, "trials": list(self.trials)}

    def unlearned(self) -> Self:
        """The same before it learned anything."""
        return replace(self, trials_learned=0, trials=())

    def touch_model(self) -> TouchModel | None:
        """The touch model that follows from the trials; None where they are too few."""
        return self.learner(Reach(1e-3, 0.1), frozen=True).model

    def learner(self, reach: Reach, *, frozen: bool) -> BeliefLearner:
        """The learner that has learned this, at work in a task."""
        learner = BeliefLearner(self.parameters, reach.half_width_m, reach.action_s, frozen=frozen)
        learner.set_state(self.state())
        return learner
