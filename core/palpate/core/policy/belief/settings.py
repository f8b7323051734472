"""Settings of the learner that acts by a belief over the hole's place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Any, ClassVar

from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.ports import Range, Settings


@dataclass(frozen=True, slots=True, kw_only=True)
class BeliefParameters(Settings):
    """Of the learner belief: what does not follow from the task."""

    TABLE: ClassVar[str] = "learning.belief"
    UNTOLD: ClassVar[Mapping[str, Any]] = MappingProxyType(
        {
            "symbol_Nm": 0.0,
            "kept": 0.97,
            "search_speed_mm_s": 0.0,
            "regrip_share": 0.0,
            "graded_misses": False,
            "even_search": False,
            "other_tool": False,
            "single_precision": False,
        }
    )

    capture_mm: Annotated[float, Range(0.02, 2.0)] = 0.15
    """A hole within this distance of the peg's way takes it in."""
    speed_mm_s: Annotated[float, Range(1.0, 100.0)] = 19.0
    """Speed of a longest step, its rest included."""
    kept: Annotated[float, Range(0.5, 1.0)] = 0.985
    """Share of the evidence that is left after one more touch: what was learned may be a little wrong."""
    search_speed_mm_s: Annotated[float, Range(0.0, 100.0)] = 16.0
    """Speed of a search: faster, the peg slides over holes that it should drop into. 0 is speed_mm_s."""
    pitch_mm: Annotated[float, Range(0.05, 5.0)] = 0.3
    """Distance between the turns of a search; at most twice the capture width, or it leaves gaps."""
    even_search: bool = True
    """Whether no step of a search is faster than search_speed_mm_s; before, those far out were up to half as fast again
    and slid over holes."""
    memory_trials: Annotated[int, Range(2, 1000)] = 60
    """So many trials are remembered; what is older is forgotten."""
    patience: Annotated[int, Range(1, 1000)] = 60
    """After so many steps by the belief a search round the likeliest place begins, and then the belief anew; after as
    many again a search of everything, to the end."""
    search_steps: Annotated[int, Range(1, 10000)] = 40
    """Steps of the first of these searches."""
    regrip_share: Annotated[float, Range(0.0, 0.5)] = 0.05
    """How likely the tool leans otherwise than in the trials before; 0: the touch model of before, without a
    lean."""
    graded_misses: bool = True
    """Whether a place off the way that was gone is less surely no hole the further off it is, up to one and a half
    capture_mm; else all within capture_mm are alike."""
    single_precision: bool = True
    """Whether what is believed of each place is reckoned in single precision, which takes less time and rounds by far
    less than a sensor's noise; before, in double."""
    other_tool: bool = False
    """Whether a policy file whose touch model is of another peg may be the beginning; else it is refused."""
    symbol_Nm: Annotated[float, Range(0.0, 10.0)] = 0.0
    """0: torques count as they are; else only whether each component is below, within or above so much, as in the
    paper, where it is 0.7 kgf mm, 0.006865 N m."""

    @override
    def check(self) -> None:
        if self.pitch_mm > 2.0 * self.capture_mm:
            accepted = f"at most twice capture_mm, {2.0 * self.capture_mm:g}, or a search leaves gaps"
            raise ConfigurationError(self.dotted("pitch_mm"), self.pitch_mm, accepted)
