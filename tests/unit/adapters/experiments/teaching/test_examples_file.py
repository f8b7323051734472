from palpate.adapters.config import RunConfig
from palpate.adapters.experiments import task_actions
from palpate.adapters.experiments.teaching import Shown, taught_table

ACTIONS = task_actions(RunConfig())
SHOWN = [Shown(0, 0, "b", "-x"), Shown(0, 1, "b", "+x"), Shown(1, 0, "b", "-x"), Shown(1, 1, "a", "+y")]


def test_the_table_counts_and_names_conflicts() -> None:
    head, a, b, left = taught_table(("a", "b", "c"), ACTIONS, SHOWN).splitlines()
    assert head.split() == ["state", "acts", *(action.name for action in ACTIONS), "conflict"]
    assert a.split() == ["a", "+y", ".", ".", "1", ".", ".", ".", ".", "."]
    assert b.split(maxsplit=10) == ["b", "-x", "1", ".", ".", ".", "2", ".", ".", ".", "1 of 3 show another"]
    assert left == "1 of 3 states have no example"
    assert taught_table(("a", "b"), ACTIONS, SHOWN).endswith("every state has an example\n")
