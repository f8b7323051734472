"""What was shown: a file of examples, and a table of them."""

from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass
from typing import Final

from palpate.adapters.log import aligned, csv_text
from palpate.core.policy import Action, ExamplesPolicy

EXAMPLES_FILE: Final = "examples.csv"


@dataclass(frozen=True, slots=True)
class Shown:
    """One example.

    Attributes:
        trial: Number of the trial in the course of its series.
        number: Number of the action in its trial.
        state: Name of the state.
        action: Name of the compass step that was shown for it.
    """

    trial: int
    number: int
    state: str
    action: str


def examples_text(shown: Iterable[Shown]) -> str:
    """The file of examples, for ``learning.examples``."""
    return csv_text([("trial", "number", "state", "action"), *map(astuple, shown)])


def taught_table(states: Sequence[str], actions: Sequence[Action], shown: Iterable[Shown]) -> str:
    """How often each state was shown each action, what the policy from examples makes of it, and where shown differ."""
    policy = ExamplesPolicy(states, actions, ((one.state, one.action) for one in shown))
    rows = [("state", "acts", *(action.name for action in actions), "conflict")]
    left = 0
    for state, name in enumerate(states):
        counts, best = policy.counts[state], policy.assigned(state)
        if best is None:
            left += 1
            continue
        most, total = counts[best], sum(counts)
        conflict = "" if most == total else f"{total - most} of {total} show another"
        rows.append((name, actions[best].name, *(str(count) if count else "." for count in counts), conflict))
    text = aligned(rows, left=2)
    return text + (f"{left} of {len(states)} states have no example\n" if left else "every state has an example\n")
