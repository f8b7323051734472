"""Settings of the learner that acts by a belief over the hole's place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.ports import Range, Settings


@dataclass(frozen=True, slots=True, kw_only=True)
class BeliefParameters(Settings):
    """Of the learner belief: what does not follow from the task."""

    TABLE: ClassVar[str] = "learning.belief"

    capture_mm: Annotated[float, Range(0.02, 2.0)] = 0.15
    """A hole within this distance of the peg's way takes it in."""
    speed_mm_s: Annotated[float, Range(1.0, 100.0)] = 19.0
    """Speed of a longest step, its rest included."""
    kept: Annotated[float, Range(0.5, 1.0)] = 0.985
    """Share of the evidence that is left after one more touch: what was learned may be a little wrong."""
    search_speed_mm_s: Annotated[float, Range(1.0, 100.0)] = 16.0
    """Highest speed of a search: faster, the peg slides over holes that it should drop into."""
    pitch_mm: Annotated[float, Range(0.05, 5.0)] = 0.3
    """Distance between the turns of a search; at most twice the capture width, or it leaves gaps."""
    memory_trials: Annotated[int, Range(2, 1000)] = 60
    """So many trials are remembered; what is older is forgotten."""
    patience: Annotated[int, Range(1, 1000)] = 60
    """After so many steps by the belief a search round the likeliest place begins, and then the belief anew; after as
    many again a search of everything, to the end."""
    search_steps: Annotated[int, Range(1, 10000)] = 40
    """Steps of the first of these searches."""
    regrip_share: Annotated[float, Range(0.0, 0.5, above=True)] = 0.05
    """How likely the tool leans otherwise than in the trials before."""
    other_tool: bool = False
    """Whether a policy file whose touch model is of another peg may be the beginning; else it is refused."""

    @override
    def check(self) -> None:
        if self.pitch_mm > 2.0 * self.capture_mm:
            accepted = f"at most twice capture_mm, {2.0 * self.capture_mm:g}, or a search leaves gaps"
            raise ConfigurationError(self.dotted("pitch_mm"), self.pitch_mm, accepted)
