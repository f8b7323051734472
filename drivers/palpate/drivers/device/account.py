"""What a wire gave besides good samples: counted always, and told when somebody asks why there was none."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

_KEPT_NS: Final = 1_000_000_000


class Account:
    """Counters by what they count, as they stand and as they stood up to a second ago.

    One thread notes and any may ask: what was noted is replaced whole.
    """

    def __init__(self) -> None:
        self._marks: tuple[tuple[int, Mapping[str, int]], ...] = ((0, {}),)

    def note(self, now_ns: int, counts: Mapping[str, int]) -> None:
        """How the counters stand; the mapping is kept."""
        marks = self._marks
        if marks[-1][1] == counts:
            return
        old = sum(time_ns <= now_ns - _KEPT_NS for time_ns, _ in marks)
        # What held a second ago was noted before that.
        self._marks = (*marks[max(old - 1, 0) :], (now_ns, counts))

    def since(self, then_ns: int) -> dict[str, int]:
        """How much each counter has grown after that time; those that have not are left out."""
        marks = self._marks
        before = next((counts for time_ns, counts in reversed(marks) if time_ns <= then_ns), marks[0][1])
        grown = {name: count - before.get(name, 0) for name, count in marks[-1][1].items()}
        return {name: count for name, count in grown.items() if count > 0}

    def lately(self, now_ns: int) -> dict[str, int]:
        """The same for the last second."""
        return self.since(now_ns - _KEPT_NS)


def listed(counts: Mapping[str, int], last: Mapping[str, str] = MappingProxyType({})) -> str:
    """Counts for a message, some with what the last one was; empty for none."""
    told = {name: f"{count}, the last {last[name]}" if name in last else str(count) for name, count in counts.items()}
    return ", ".join(f"{name} ({text})" for name, text in told.items())
